#include "kerf/picture/quick_painter.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kerf/base/hypotenuse.h"
#include "kerf/base/parallel.h"
#include "kerf/picture/picture_noise.h"
#include "kerf/picture/picture_raster.h"

namespace kerf {
namespace {

constexpr std::int32_t kNothing = -1, kGround = -2;
constexpr float kFar = std::numeric_limits<float>::infinity();
/// Cosine between the normals of a corner and of its triangle (34 degrees). Below, the triangle's own is taken: edges of boxes, which
/// lie at 45 degrees, are sharp; edges of round things with 12 corners, at 15 degrees, are smooth.
constexpr double kSmoothCosine = 0.83;
constexpr double kKeyShare = 0.85, kSkyShare = 0.80;  // of the light, where shadows would take some
constexpr int kWide = 12;          // pixels: rows of wider triangles are clipped before they are looked at
constexpr std::size_t kRows = 16;  // of a lot for one thread

std::size_t pixel_of(int x, int y, int width) { return picture_index(y) * picture_index(width) + picture_index(x); }

/// sRGB of 0 to 1, linear. The table is nowhere coarser than bytes, whose steps are 1 / (12.92 * 255) or more.
std::uint8_t quick_srgb(double x) {
  static constexpr int kSteps = 4096;
  static const std::vector<std::uint8_t> table = [] {
    std::vector<std::uint8_t> out(kSteps + 1);
    for (int i = 0; i <= kSteps; ++i) out[picture_index(i)] = to_srgb((i + 0.5) / kSteps);
    return out;
  }();
  return table[static_cast<std::size_t>(std::clamp(x, 0.0, 1.0) * kSteps)];
}

/// Rows and columns of pixels whose middles a triangle may hold; all of them where it reaches behind the eye.
struct Bounds {
  int x0 = 0, x1 = -1, y0 = 0, y1 = -1;
};
Bounds bounds_of(Vec3 a, Vec3 b, Vec3 c, const PictureCamera& camera, int width, int height) {
  if (a.z <= 0 && b.z <= 0 && c.z <= 0) return {};
  if (!(a.z > 0 && b.z > 0 && c.z > 0)) return {0, width - 1, 0, height - 1};
  const double ax = a.x / a.z, bx = b.x / b.z, cx = c.x / c.z, ay = a.y / a.z, by = b.y / b.z, cy = c.y / c.z;
  constexpr double kSlack = 1e-6;  // pixels: a rounding error more than these quotients have
  const double left = std::min({ax, bx, cx}) + camera.half_width - 0.5 - kSlack,
               right = std::max({ax, bx, cx}) + camera.half_width - 0.5 + kSlack,
               top = std::min({ay, by, cy}) + camera.half_height - 0.5 - kSlack,
               bottom = std::max({ay, by, cy}) + camera.half_height - 0.5 + kSlack;
  if (!(left <= width - 1 && right >= 0 && top <= height - 1 && bottom >= 0)) return {};
  return {static_cast<int>(std::ceil(std::max(left, 0.0))), static_cast<int>(std::floor(std::min(right, width - 1.0))),
          static_cast<int>(std::ceil(std::max(top, 0.0))),
          static_cast<int>(std::floor(std::min(bottom, height - 1.0)))};
}

/// Of x0 to x1, where along * x + start is 0 or more, give or take a pixel.
void clip_row(double along, double start, int& x0, int& x1) {
  if (along == 0) {
    if (start < 0) x1 = x0 - 1;
    return;
  }
  const double x = std::clamp(-start / along, -2.0, 1e9);
  if (along > 0) x0 = std::max(x0, static_cast<int>(x) - 1);
  else x1 = std::min(x1, static_cast<int>(x) + 1);
}

}  // namespace

void QuickPainter::draw(const QuickStage& stage, const PictureView& view, const QuickTarget& target) {
  camera_ = camera_of(view, target.width, target.height);
  gather(stage);
  rasterise(target.width, target.height);
  if (stage.ground_at) see_ground(stage, target);
  std::copy_n(depth_.begin(), target.depth.size(), target.depth.begin());
  if (target.rgb.empty()) return;
  lights_ = StageLights(camera_);
  rest_box_ = {};
  for (const Vec3 p : stage.body.rest) rest_box_.add(p);
  find_normals(stage.body.wall);
  shade(stage, target);
}

void QuickPainter::gather(const QuickStage& stage) {
  parts_.clear();
  std::size_t vertices = 0, triangles = 0;
  const auto add = [&](std::span<const Vec3> positions, std::span<const Triangle> corners) {
    parts_.push_back({positions, corners, vertices, triangles});
    vertices += positions.size();
    triangles += corners.size();
  };
  add(stage.body.positions, stage.body.triangles);
  for (const PictureThing& thing : stage.things) add(thing.positions, thing.triangles);
  seen_.resize(vertices);
  const Vec3 right = camera_.focal * camera_.right, down = -camera_.focal * camera_.up, ahead = -camera_.back;
  for (const Part& part : parts_)
    for (std::size_t v = 0; v < part.positions.size(); ++v) {
      const Vec3 d = part.positions[v] - camera_.eye;
      seen_[part.first_vertex + v] = {dot(d, right), dot(d, down), dot(d, ahead)};
    }
}

// A pixel's ray is (x, y, 1) from the eye, in the axes of seen_. It passes an edge pq on the side that the sign of its product with p x q tells,
// wherever p and q are, behind the eye too. Neighbours have the same product but for its sign: no ray slips through between them.

void QuickPainter::rasterise(int width, int height) {
  ids_.assign(picture_index(width) * picture_index(height), kNothing);
  depth_.assign(ids_.size(), kFar);
  for (const Part& part : parts_) rasterise(part, width, height);
}

void QuickPainter::rasterise(const Part& part, int width, int height) {
  for (std::size_t t = 0; t < part.triangles.size(); ++t) {
    const Triangle& tri = part.triangles[t];
    const Vec3* seen = seen_.data() + part.first_vertex;
    const Vec3 a = seen[tri[0]], b = seen[tri[1]], c = seen[tri[2]];
    const Bounds in = bounds_of(a, b, c, camera_, width, height);
    if (in.x0 > in.x1 || in.y0 > in.y1) continue;
    Vec3 ea = cross(b, c), eb = cross(c, a), ec = cross(a, b);
    double volume = dot(a, ea);
    if (volume == 0 || !std::isfinite(volume)) continue;  // seen from its side
    if (volume < 0) ea = -ea, eb = -eb, ec = -ec, volume = -volume;
    for (int y = in.y0; y <= in.y1; ++y) {
      const double ry = y + 0.5 - camera_.half_height;
      const double sa = ea.y * ry + ea.z, sb = eb.y * ry + eb.z, sc = ec.y * ry + ec.z;
      int x0 = in.x0, x1 = in.x1;
      if (x1 - x0 > kWide) {
        const double shift = 0.5 - camera_.half_width;
        clip_row(ea.x, sa + ea.x * shift, x0, x1);
        clip_row(eb.x, sb + eb.x * shift, x0, x1);
        clip_row(ec.x, sc + ec.x * shift, x0, x1);
      }
      for (int x = x0; x <= x1; ++x) {
        const double rx = x + 0.5 - camera_.half_width;
        const double wa = ea.x * rx + sa, wb = eb.x * rx + sb, wc = ec.x * rx + sc;
        if (!(wa >= 0 && wb >= 0 && wc >= 0)) continue;
        const auto z = static_cast<float>(volume / (wa + wb + wc));
        const std::size_t i = pixel_of(x, y, width);
        if (!(z < depth_[i])) continue;
        depth_[i] = z;
        ids_[i] = static_cast<std::int32_t>(part.first_triangle + t);
      }
    }
  }
}

void QuickPainter::see_ground(const QuickStage& stage, const QuickTarget& target) {
  const double height = *stage.ground_at - camera_.eye.z;
  for (int y = 0; y < target.height; ++y)
    for (int x = 0; x < target.width; ++x) {
      const double rx = (x + 0.5 - camera_.half_width) / camera_.focal,
                   ry = (camera_.half_height - y - 0.5) / camera_.focal;
      const double rise = rx * camera_.right.z + ry * camera_.up.z - camera_.back.z;  // per metre along the view
      const auto z = static_cast<float>(height / rise);
      const std::size_t i = pixel_of(x, y, target.width);
      if (!(z > 0 && z < depth_[i])) continue;
      depth_[i] = z;
      ids_[i] = kGround;
    }
}

void QuickPainter::find_normals(std::span<const std::uint8_t> wall) {
  normals_.assign(seen_.size(), {});
  for (const Part& part : parts_) {
    Vec3* normals = normals_.data() + part.first_vertex;
    for (std::size_t t = 0; t < part.triangles.size(); ++t) {
      if (is_wall(part, t, wall)) continue;
      const Triangle& tri = part.triangles[t];
      const Vec3 a = part.positions[picture_index(tri[0])];
      const Vec3 n = cross(part.positions[picture_index(tri[1])] - a, part.positions[picture_index(tri[2])] - a);
      for (const std::int32_t v : tri) normals[v] += n;
    }
  }
  for (Vec3& n : normals_) n = normalized(n);
}

bool QuickPainter::is_wall(const Part& part, std::size_t triangle, std::span<const std::uint8_t> wall) {
  return part.first_triangle + triangle < wall.size() && wall[triangle] != 0;
}

QuickPainter::Hit QuickPainter::hit(Vec3 a, Vec3 b, Vec3 c, int x, int y) const {
  const Vec3 ray{x + 0.5 - camera_.half_width, y + 0.5 - camera_.half_height, 1};
  Hit w{dot(ray, cross(b, c)), dot(ray, cross(c, a)), dot(ray, cross(a, b))};
  const double sum = w.a + w.b + w.c;
  if (sum == 0) return {1, 0, 0};
  return {w.a / sum, w.b / sum, w.c / sum};
}

Vec3 QuickPainter::triangle_color(const QuickStage& stage, std::int32_t id, int x, int y) const {
  const auto found = std::upper_bound(parts_.begin(), parts_.end(), picture_index(id),
                                      [](std::size_t i, const Part& part) { return i < part.first_triangle; });
  const std::size_t p = static_cast<std::size_t>(found - parts_.begin()) - 1;
  const Part& part = parts_[p];
  const std::size_t t = picture_index(id) - part.first_triangle;
  const Triangle& tri = part.triangles[t];
  const auto seen = [&](std::size_t k) { return seen_[part.first_vertex + picture_index(tri[k])]; };
  const auto place = [&](std::size_t k) { return part.positions[picture_index(tri[k])]; };
  const Hit w = hit(seen(0), seen(1), seen(2), x, y);
  const Vec3 position = w.a * place(0) + w.b * place(1) + w.c * place(2);
  const Vec3 view = normalized(camera_.eye - position);
  const Vec3 own = normalized(cross(place(1) - place(0), place(2) - place(0)));
  const bool wall = is_wall(part, t, stage.body.wall);
  const auto corner = [&](std::size_t k) {
    const Vec3 smooth = normals_[part.first_vertex + picture_index(tri[k])];
    return !wall && dot(smooth, own) >= kSmoothCosine ? smooth : own;
  };
  Vec3 n = normalized(w.a * corner(0) + w.b * corner(1) + w.c * corner(2));
  if (dot(own, view) < 0) n = -n;
  if (p > 0) return lights_.lit(thing_surface(stage.things[p - 1].stuff), n, view, kKeyShare, kSkyShare);
  const auto rest = [&](std::size_t k) { return stage.body.rest[picture_index(tri[k])]; };
  const PictureSurface surface = stage.texture->at(w.a * rest(0) + w.b * rest(1) + w.c * rest(2), wall);
  return lights_.lit(surface, n, view, kKeyShare, kSkyShare);
}

Vec3 QuickPainter::ground_color(const QuickStage& stage, int x, int y, double depth) const {
  const Vec3 ray = camera_.ray(x + 0.5, y + 0.5);
  const Vec3 p = camera_.eye + (depth / -dot(ray, camera_.back)) * ray;
  const Vec3 size = rest_box_.size();
  const double body = std::max({1e-12, size.x, size.y, size.z});
  const Vec2 q = rest_box_.empty() ? Vec2{p.x, p.y} : Vec2{p.x - rest_box_.center().x, p.y - rest_box_.center().y};
  const Look look = ground_outside(stage.body.look, q, body) <= 0 ? stage.body.look : Look::kCartilage;
  const Vec3 color = lights_.lit(ground_surface(look, q, body), {0, 0, 1}, -ray, kKeyShare, kSkyShare);
  const double fade = smooth_step(1.2 * body, 4.0 * body, hypotenuse(q.x, q.y));
  return lerp(color, backdrop(stage.body.look, (y + 0.5) / (2 * camera_.half_height)), fade);
}

void QuickPainter::shade(const QuickStage& stage, const QuickTarget& target) const {
  parallel_for(picture_index(target.height), kRows, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      const int y = static_cast<int>(row);
      const Vec3 behind = backdrop(stage.body.look, (y + 0.5) / target.height);
      for (int x = 0; x < target.width; ++x) {
        const std::size_t i = pixel_of(x, y, target.width);
        const Vec3 color = ids_[i] >= 0         ? triangle_color(stage, ids_[i], x, y)
                           : ids_[i] == kGround ? ground_color(stage, x, y, static_cast<double>(depth_[i]))
                                                : behind;
        for (int k = 0; k < 3; ++k) target.rgb[3 * i + picture_index(k)] = quick_srgb(film(color[k]));
      }
    }
  });
}

}  // namespace kerf
