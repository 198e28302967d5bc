#include "kerf/picture/picture.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

#include "kerf/base/hypotenuse.h"
#include "kerf/base/parallel.h"
#include "kerf/picture/light_map.h"
#include "kerf/picture/picture_camera.h"
#include "kerf/picture/picture_light.h"
#include "kerf/picture/picture_material.h"
#include "kerf/picture/picture_noise.h"
#include "kerf/picture/picture_raster.h"

namespace kerf {
namespace {

constexpr int kSamples = 2;          // per pixel and direction: 4 samples a pixel
constexpr int kKeyMaps = 64;         // directions that make up the soft key light
constexpr double kKeyRadius = 0.10;  // rad: its apparent radius
constexpr int kKeyResolution = 640;
constexpr int kSkyMaps = 96;  // directions of the sky
constexpr int kSkyResolution = 192;
constexpr int kGroundGrid = 160;       // points of the ground at which the sky is looked at
constexpr double kShadowBias = 0.012;  // of the body's size

using Triangle = std::array<std::int32_t, 3>;

/// Directions spread evenly over a disc (radius 1) by the golden angle.
Vec2 spiral(int i, int n) {
  const double r = std::sqrt((i + 0.5) / n), angle = 2.399963229728653 * i;
  return {r * std::cos(angle), r * std::sin(angle)};
}

/// Body and things in one list of triangles; `kind` tells them apart.
struct Cast {
  std::vector<Vec3> positions, rest, framed;
  std::vector<Triangle> triangles;
  std::vector<std::uint8_t> kind;  ///< 0 skin, 1 cut surface, kThing + what a thing is made of

  Cast(const PictureBody& body, std::span<const PictureThing> things)
      : positions(body.positions.begin(), body.positions.end()), rest(body.rest.begin(), body.rest.end()),
        framed(positions), triangles(body.triangles.begin(), body.triangles.end()),
        kind(body.wall.begin(), body.wall.end()) {
    kind.resize(triangles.size());
    for (const PictureThing& thing : things) {
      const auto first = static_cast<std::int32_t>(positions.size());
      positions.insert(positions.end(), thing.positions.begin(), thing.positions.end());
      if (thing.framed) framed.insert(framed.end(), thing.positions.begin(), thing.positions.end());
      for (const Triangle& t : thing.triangles) triangles.push_back({first + t[0], first + t[1], first + t[2]});
      kind.resize(triangles.size(), static_cast<std::uint8_t>(kThing + static_cast<int>(thing.stuff)));
    }
    rest.resize(positions.size());
  }
  [[nodiscard]] PictureBody body(Look look) const { return {positions, rest, triangles, kind, look}; }
  static constexpr int kThing = 2;
};

class Stage {
 public:
  Stage(const PictureBody& body, std::span<const PictureLine> lines, const PictureOptions& options,
        std::span<const PictureThing> things)
      : cast_(body, things), body_(cast_.body(body.look)), lines_(lines), options_(options), texture_(body),
        width_(options.width * kSamples), height_(options.height * kSamples) {
    for (Vec3 p : cast_.framed) box_.add(p);
    for (Vec3 p : body.rest) rest_box_.add(p);
    size_ = std::max(1e-12, std::max({rest_box_.size().x, rest_box_.size().y, rest_box_.size().z}));
    camera_ = options.view ? camera_of(*options.view, width_, height_)
                           : fitted_camera(cast_.framed, body.positions.size(), options, width_, height_);
    ground_z_ = options.ground_at.value_or(box_.empty() ? 0 : box_.min.z) - 1e-3 * size_;
    normals_ = corner_normals(body_);
    set_lights();
    look_at_sky();
    rasterise();
  }

  Picture draw() {
    Picture out{options_.width, options_.height, {}};
    out.rgb.resize(3 * picture_index(options_.width) * picture_index(options_.height));
    std::vector<Vec3> colors(picture_index(options_.width) * picture_index(options_.height));
    parallel_for(picture_index(options_.height), 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t y = begin; y < end && !stopped(); ++y) {
        for (int x = 0; x < options_.width; ++x)
          colors[y * picture_index(options_.width) + picture_index(x)] = pixel(x, static_cast<int>(y));
      }
    });
    if (stopped()) return out;
    draw_lines(colors);
    for (std::size_t i = 0; i < colors.size(); ++i) {
      for (int k = 0; k < 3; ++k) out.rgb[3 * i + picture_index(k)] = to_srgb(colors[i][k]);
    }
    return out;
  }

 private:
  /// One of the threads that draw may be the one that hears the wish.
  [[nodiscard]] bool stopped() const {
    if (!options_.stop) return false;
    if (!stopped_ && options_.stop()) stopped_ = true;
    return stopped_;
  }

  void set_lights() {
    lights_ = StageLights(camera_);
    const Vec3 key = lights_.key;
    const auto [u, v] = perpendicular(key);
    if (box_.empty()) return;
    for (int i = 0; i < kKeyMaps && !stopped(); ++i) {
      const Vec2 s = spiral(i, kKeyMaps);
      key_maps_.emplace_back(body_, box_, normalized(key + (kKeyRadius * s.x) * u + (kKeyRadius * s.y) * v),
                             kKeyResolution);
    }
  }

  /// How much of the sky each vertex and the ground see.
  void look_at_sky() {
    vertex_sky_.assign(body_.positions.size(), 0);
    ground_sky_.assign(picture_index(kGroundGrid) * picture_index(kGroundGrid), 1);
    if (box_.empty()) return;
    std::vector<Vec3> normal(body_.positions.size());
    for (std::size_t t = 0; t < normals_.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) normal[picture_index(body_.triangles[t][k])] += normals_[t][k];
    }
    for (Vec3& n : normal) n = normalized(n);
    std::vector<LightMap> maps;
    maps.reserve(kSkyMaps);
    // All round: undersides see the light that the ground throws back.
    for (int i = 0; i < kSkyMaps && !stopped(); ++i) {
      const double z = 1 - 2 * (i + 0.5) / kSkyMaps, angle = 2.399963229728653 * i, r = std::sqrt(1 - z * z);
      maps.emplace_back(body_, box_, Vec3{r * std::cos(angle), r * std::sin(angle), z}, kSkyResolution);
    }
    const double bias = kShadowBias * size_;
    parallel_for(body_.positions.size(), 1024, [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = begin; v < end && !stopped(); ++v) {
        double seen = 0, all = 1e-9;
        for (const LightMap& map : maps) {
          const double c = dot(normal[v], map.direction());
          if (c <= 0) continue;
          all += c;
          double light = map.light(body_.positions[v] + bias * normal[v], 0.3 * bias);
          if (options_.ground && map.direction().z < 0) light *= 0.45;
          seen += c * light;
        }
        vertex_sky_[v] = static_cast<float>(seen / all);
      }
    });
    grid_size_ = 2.6 * size_;
    grid_low_ = {box_.center().x - 0.5 * grid_size_, box_.center().y - 0.5 * grid_size_};
    parallel_for(picture_index(kGroundGrid), 8, [&](std::size_t begin, std::size_t end) {
      for (std::size_t j = begin; j < end && !stopped(); ++j) {
        for (std::size_t i = 0; i < picture_index(kGroundGrid); ++i) {
          const Vec3 p{grid_low_.x + grid_size_ * (static_cast<double>(i) + 0.5) / kGroundGrid,
                       grid_low_.y + grid_size_ * (static_cast<double>(j) + 0.5) / kGroundGrid, ground_z_};
          double seen = 0, all = 1e-9;
          for (const LightMap& map : maps) {
            const double c = map.direction().z;
            if (c <= 0) continue;
            all += c;
            seen += c * map.light(p, 0);
          }
          ground_sky_[j * picture_index(kGroundGrid) + i] = static_cast<float>(seen / all);
        }
      }
    });
  }

  void rasterise() {
    screen_.resize(body_.positions.size());
    for (std::size_t v = 0; v < screen_.size(); ++v) screen_[v] = camera_.project(body_.positions[v]);
    id_.assign(picture_index(width_) * picture_index(height_), -1);
    inverse_z_.assign(picture_index(width_) * picture_index(height_), 0.0f);
    constexpr std::size_t kBand = 64;
    parallel_for(picture_index(height_), kBand, [&](std::size_t begin, std::size_t end) {
      for (std::size_t t = 0; t < body_.triangles.size(); ++t) {
        if (t % 1024 == 0 && stopped()) return;
        const Triangle& tri = body_.triangles[t];
        const Vec3 a = screen_[picture_index(tri[0])], b = screen_[picture_index(tri[1])],
                   c = screen_[picture_index(tri[2])];
        if (!(a.z > 0 && b.z > 0 && c.z > 0)) continue;
        fill_triangle({a.x, a.y}, {b.x, b.y}, {c.x, c.y}, width_, static_cast<int>(begin), static_cast<int>(end),
                      [&](int x, int y, double wa, double wb, double wc) {
                        const std::size_t i = picture_index(y) * picture_index(width_) + picture_index(x);
                        const auto z = static_cast<float>(wa / a.z + wb / b.z + wc / c.z);
                        if (z <= inverse_z_[i]) return;
                        inverse_z_[i] = z;
                        id_[i] = static_cast<std::int32_t>(t);
                      });
      }
    });
  }

  [[nodiscard]] double key_light(Vec3 p, double bias) const {
    double sum = 0;
    for (const LightMap& map : key_maps_) sum += map.light(p, bias);
    return key_maps_.empty() ? 1 : sum / static_cast<double>(key_maps_.size());
  }

  [[nodiscard]] Vec3 body_color(std::int32_t t, double x, double y) const {
    const Triangle& tri = body_.triangles[picture_index(t)];
    const Vec3 a = screen_[picture_index(tri[0])], b = screen_[picture_index(tri[1])],
               c = screen_[picture_index(tri[2])];
    const Vec2 p{x, y};
    const double area = cross(Vec2{b.x - a.x, b.y - a.y}, Vec2{c.x - a.x, c.y - a.y});
    double w[3] = {cross(Vec2{c.x - b.x, c.y - b.y}, p - Vec2{b.x, b.y}) / area,
                   cross(Vec2{a.x - c.x, a.y - c.y}, p - Vec2{c.x, c.y}) / area, 0};
    w[2] = 1 - w[0] - w[1];
    const double z[3] = {a.z, b.z, c.z};
    double sum = 0;
    for (int k = 0; k < 3; ++k) sum += w[k] = std::clamp(w[k], 0.0, 1.0) / z[k];
    Vec3 position, rest, n;
    double sky = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      w[k] /= sum;
      position += w[k] * body_.positions[picture_index(tri[k])];
      rest += w[k] * body_.rest[picture_index(tri[k])];
      n += w[k] * normals_[picture_index(t)][k];
      sky += w[k] * static_cast<double>(vertex_sky_[picture_index(tri[k])]);
    }
    n = normalized(n);
    const Vec3 view = normalized(camera_.eye - position);
    if (options_.two_sided && dot(n, view) < 0) n = -n;
    const std::uint8_t kind = body_.wall[picture_index(t)];
    const bool wall = kind == 1;
    PictureSurface surface = kind >= Cast::kThing ? thing_surface(static_cast<PictureThing::Stuff>(kind - Cast::kThing))
                                                  : texture_.at(rest, wall);
    if (surface.bump != 0) {
      // Tangents in the deformed body and the steps at rest that belong to them.
      const Vec3 e1 = body_.positions[picture_index(tri[1])] - body_.positions[picture_index(tri[0])],
                 e2 = body_.positions[picture_index(tri[2])] - body_.positions[picture_index(tri[0])];
      const Vec3 r1 = body_.rest[picture_index(tri[1])] - body_.rest[picture_index(tri[0])],
                 r2 = body_.rest[picture_index(tri[2])] - body_.rest[picture_index(tri[0])];
      const double g11 = dot(e1, e1), g12 = dot(e1, e2), g22 = dot(e2, e2), det = g11 * g22 - g12 * g12;
      if (det > 1e-12 * g11 * g22) {
        const auto [u, v] = perpendicular(n);
        const double step = 0.02 * texture_.detail();
        Vec3 slope;
        for (Vec3 tangent : {u, v}) {
          const double d1 = dot(tangent, e1), d2 = dot(tangent, e2);
          const double s1 = (g22 * d1 - g12 * d2) / det, s2 = (g11 * d2 - g12 * d1) / det;
          const PictureSurface moved = texture_.at(rest + step * (s1 * r1 + s2 * r2), wall);
          slope += ((moved.bump - surface.bump) / step) * tangent;
        }
        n = normalized(n - slope);
      }
    }
    const double bias = kShadowBias * size_;
    const double key = dot(n, lights_.key) > -surface.wrap ? key_light(position + bias * n, 0.3 * bias) : 0;
    return lights_.lit(surface, n, view, key, sky);
  }

  [[nodiscard]] Vec3 backdrop(double y) const { return kerf::backdrop(body_.look, y / height_); }

  [[nodiscard]] double ground_sky(Vec3 p) const {
    const double x = std::clamp((p.x - grid_low_.x) / grid_size_ * kGroundGrid - 0.5, 0.0, kGroundGrid - 1.001);
    const double y = std::clamp((p.y - grid_low_.y) / grid_size_ * kGroundGrid - 0.5, 0.0, kGroundGrid - 1.001);
    const auto i = static_cast<std::size_t>(x), j = static_cast<std::size_t>(y);
    const double u = x - std::floor(x), v = y - std::floor(y);
    const auto g = [&](std::size_t a, std::size_t b) {
      return static_cast<double>(ground_sky_[b * picture_index(kGroundGrid) + a]);
    };
    return (1 - v) * ((1 - u) * g(i, j) + u * g(i + 1, j)) + v * ((1 - u) * g(i, j + 1) + u * g(i + 1, j + 1));
  }

  [[nodiscard]] Vec3 ground_color(double x, double y) const {
    const Vec3 background = backdrop(y);
    const Vec3 d = camera_.ray(x, y);
    if (!options_.ground || box_.empty() || d.z >= -1e-6) return background;
    const double distance = (ground_z_ - camera_.eye.z) / d.z;
    const Vec3 p = camera_.eye + distance * d;
    const Vec2 q{p.x - rest_box_.center().x, p.y - rest_box_.center().y};
    const double pixel_size = distance / camera_.focal / std::max(0.1, -d.z);
    const double on = 1 - smooth_step(-pixel_size, pixel_size, ground_outside(body_.look, q, size_));
    if (on <= 0) return background;
    const PictureSurface surface = ground_surface(body_.look, q, size_);
    const double key = key_light(p, 1e-3 * size_);
    Vec3 color = lights_.lit(surface, {0, 0, 1}, -d, key, ground_sky(p));
    const double fade = body_.look == Look::kMeat ? 0 : smooth_step(1.2 * size_, 4.0 * size_, hypotenuse(q.x, q.y));
    color = color + fade * (background - color);
    return background + on * (color - background);
  }

  /// Shaded once per different thing in the pixel, at the middle of its samples.
  [[nodiscard]] Vec3 pixel(int px, int py) const {
    constexpr int kCount = kSamples * kSamples;
    std::int32_t ids[kCount];
    Vec2 points[kCount];
    for (int i = 0; i < kCount; ++i) {
      const int x = px * kSamples + i % kSamples, y = py * kSamples + i / kSamples;
      ids[i] = id_[picture_index(y) * picture_index(width_) + picture_index(x)];
      points[i] = {x + 0.5, y + 0.5};
    }
    Vec3 sum;
    bool done[kCount] = {};
    for (int i = 0; i < kCount; ++i) {
      if (done[i]) continue;
      Vec2 middle;
      int n = 0;
      for (int j = i; j < kCount; ++j) {
        if (ids[j] != ids[i]) continue;
        done[j] = true;
        middle = middle + points[j];
        ++n;
      }
      middle = (1.0 / n) * middle;
      const Vec3 color = ids[i] >= 0 ? body_color(ids[i], middle.x, middle.y) : ground_color(middle.x, middle.y);
      sum += static_cast<double>(n) * Vec3{film(color.x), film(color.y), film(color.z)};
    }
    const double dx = 2.0 * px / options_.width - 1, dy = 2.0 * py / options_.height - 1;
    const double vignette = 1 - 0.10 * (dx * dx + dy * dy);
    return (vignette / kCount) * sum;
  }

  void draw_lines(std::vector<Vec3>& colors) const {
    for (const PictureLine& line : lines_) {
      if (stopped()) return;
      const Vec3 a = camera_.project(line.a), b = camera_.project(line.b);
      if (!(a.z > 0 && b.z > 0)) continue;
      const Vec2 p{a.x / kSamples, a.y / kSamples}, q{b.x / kSamples, b.y / kSamples};
      const double reach = 0.5 * static_cast<double>(line.width) + 0.5;
      const int x0 = std::max(0, static_cast<int>(std::min(p.x, q.x) - reach)),
                x1 = std::min(options_.width - 1, static_cast<int>(std::max(p.x, q.x) + reach));
      const int y0 = std::max(0, static_cast<int>(std::min(p.y, q.y) - reach)),
                y1 = std::min(options_.height - 1, static_cast<int>(std::max(p.y, q.y) + reach));
      const Vec2 e = q - p;
      const double length2 = std::max(1e-12, dot(e, e));
      for (int y = y0; y <= y1; ++y) {
        for (int x = x0; x <= x1; ++x) {
          const Vec2 c{x + 0.5, y + 0.5};
          const double t = std::clamp(dot(c - p, e) / length2, 0.0, 1.0);
          const double cover = std::clamp(reach - norm(c - (p + t * e)), 0.0, 1.0) * static_cast<double>(line.opacity);
          if (cover <= 0) continue;
          const double inverse = (1 - t) / a.z + t / b.z;
          const std::size_t sample = picture_index(y * kSamples) * picture_index(width_) + picture_index(x * kSamples);
          const double front = static_cast<double>(inverse_z_[sample]);
          if (front > 0 && 1 / inverse > (1 / front) + 0.006 * size_) continue;  // behind the body
          Vec3& color = colors[picture_index(y) * picture_index(options_.width) + picture_index(x)];
          color = color + cover * (to_double(line.color) - color);
        }
      }
    }
  }

  Cast cast_;
  PictureBody body_;
  std::span<const PictureLine> lines_;
  PictureOptions options_;
  mutable std::atomic<bool> stopped_ = false;
  BodyTexture texture_;
  int width_, height_;
  Box3 box_, rest_box_;
  double size_ = 1, ground_z_ = 0;
  PictureCamera camera_;
  StageLights lights_;
  std::vector<std::array<Vec3, 3>> normals_;
  std::vector<LightMap> key_maps_;
  std::vector<float> vertex_sky_, ground_sky_;
  Vec2 grid_low_;
  double grid_size_ = 1;
  std::vector<Vec3> screen_;
  std::vector<std::int32_t> id_;
  std::vector<float> inverse_z_;
};

}  // namespace

Picture draw_picture(const PictureBody& body, std::span<const PictureLine> lines, const PictureOptions& options,
                     std::span<const PictureThing> things) {
  return Stage(body, lines, options, things).draw();
}

}  // namespace kerf
