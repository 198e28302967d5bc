#include "kerf/picture/picture_material.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "kerf/base/hypotenuse.h"
#include "kerf/picture/picture_noise.h"

namespace kerf {
namespace {

Vec3 mix(Vec3 a, Vec3 b, double t) { return a + t * (b - a); }

constexpr int kGrid = 384;  // cells of the distance field along the longest extent

}  // namespace

BodyTexture::BodyTexture(const PictureBody& body) : look_(body.look) {
  for (Vec3 p : body.rest) box_.add(p);
  const Vec3 size = box_.size();
  std::stable_sort(axes_, axes_ + 3, [&](int a, int b) { return size[a] > size[b]; });
  size_ = std::max(1e-12, size[axes_[0]]) / 20;
  if (look_ != Look::kMeat || box_.empty()) return;
  // A mask of the body seen along its thin axis, then the distance to its outside by two chamfer sweeps.
  grid_ = kGrid;
  const double cell = 20 * size_ / (kGrid - 8);
  const auto n = static_cast<std::size_t>(kGrid);
  distance_.assign(n * n, 0.0f);
  const auto to_grid = [&](Vec3 p) {
    return Vec2{(p[axes_[0]] - box_.center()[axes_[0]]) / cell + kGrid / 2.0,
                (p[axes_[1]] - box_.center()[axes_[1]]) / cell + kGrid / 2.0};
  };
  for (const auto& t : body.triangles) {
    const Vec2 a = to_grid(body.rest[static_cast<std::size_t>(t[0])]),
               b = to_grid(body.rest[static_cast<std::size_t>(t[1])]),
               c = to_grid(body.rest[static_cast<std::size_t>(t[2])]);
    const int x0 = std::max(0, static_cast<int>(std::min({a.x, b.x, c.x}))),
              x1 = std::min(kGrid - 1, static_cast<int>(std::max({a.x, b.x, c.x})) + 1);
    const int y0 = std::max(0, static_cast<int>(std::min({a.y, b.y, c.y}))),
              y1 = std::min(kGrid - 1, static_cast<int>(std::max({a.y, b.y, c.y})) + 1);
    const double area = cross(b - a, c - a);
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x) {
        const Vec2 p{static_cast<double>(x), static_cast<double>(y)};
        const double u = cross(b - a, p - a) * area, v = cross(c - b, p - b) * area, w = cross(a - c, p - c) * area;
        if (u >= 0 && v >= 0 && w >= 0) distance_[static_cast<std::size_t>(y) * n + static_cast<std::size_t>(x)] = 1e6f;
      }
    }
  }
  const float straight = static_cast<float>(cell), diagonal = static_cast<float>(1.4142 * cell);
  const auto relax = [&](int x, int y, int dx, int dy, float step) {
    if (x + dx < 0 || y + dy < 0 || x + dx >= kGrid || y + dy >= kGrid) return;
    float& d = distance_[static_cast<std::size_t>(y) * n + static_cast<std::size_t>(x)];
    d = std::min(d, distance_[static_cast<std::size_t>(y + dy) * n + static_cast<std::size_t>(x + dx)] + step);
  };
  for (int y = 0; y < kGrid; ++y) {
    for (int x = 0; x < kGrid; ++x) {
      relax(x, y, -1, 0, straight), relax(x, y, 0, -1, straight), relax(x, y, -1, -1, diagonal),
          relax(x, y, 1, -1, diagonal);
    }
  }
  for (int y = kGrid; y-- > 0;) {
    for (int x = kGrid; x-- > 0;) {
      relax(x, y, 1, 0, straight), relax(x, y, 0, 1, straight), relax(x, y, 1, 1, diagonal),
          relax(x, y, -1, 1, diagonal);
    }
  }
  soften();
}

void BodyTexture::soften() {
  const auto n = static_cast<std::size_t>(kGrid);
  for (int round = 0; round < 4; ++round) {
    std::vector<float> next = distance_;
    for (std::size_t y = 1; y + 1 < n; ++y) {
      for (std::size_t x = 1; x + 1 < n; ++x) {
        float sum = 0;
        for (std::size_t j = y - 1; j <= y + 1; ++j) {
          for (std::size_t i = x - 1; i <= x + 1; ++i) sum += distance_[j * n + i];
        }
        next[y * n + x] = sum / 9;
      }
    }
    distance_.swap(next);
  }
}

double BodyTexture::distance_to_outline(Vec3 q) const {
  const double cell = 20 * size_ / (kGrid - 8);
  const double x = std::clamp(q.x / cell + kGrid / 2.0, 0.0, kGrid - 1.001),
               y = std::clamp(q.y / cell + kGrid / 2.0, 0.0, kGrid - 1.001);
  const auto i = static_cast<std::size_t>(x), j = static_cast<std::size_t>(y);
  const double u = x - std::floor(x), v = y - std::floor(y);
  const auto at = [&](std::size_t a, std::size_t b) {
    return static_cast<double>(distance_[b * static_cast<std::size_t>(kGrid) + a]);
  };
  return (1 - v) * ((1 - u) * at(i, j) + u * at(i + 1, j)) + v * ((1 - u) * at(i, j + 1) + u * at(i + 1, j + 1));
}

PictureSurface BodyTexture::meat(Vec3 q, Vec3, bool wall) const {
  const Vec3 s = (1 / size_) * q;  // 20 units across the body
  // Muscle: bundles of fibres, darker between them.
  const Vec3 bent = s + 0.6 * Vec3{noise(0.35 * s), noise(0.35 * s + Vec3{31, 7, 3}), noise(0.35 * s + Vec3{5, 77, 9})};
  const double fibre = fractal_noise({2.2 * bent.x, 2.2 * bent.y, 1.1 * bent.z}, 3);
  const double fine = noise({26 * s.x, 22 * s.y, 18 * s.z});
  const double tone = noise(0.22 * s + Vec3{3, 3, 3});
  Vec3 red = mix({0.26, 0.012, 0.016}, {0.46, 0.030, 0.032}, 0.5 + 0.55 * fibre + 0.35 * tone);
  red = (1 + 0.07 * fine) * red;
  if (wall) red = mix(red, {0.62, 0.055, 0.050}, 0.45);  // fresh flesh is brighter

  // Marbling: thin crooked sheets of fat where a warped noise passes zero, more of them in some places than
  // in others.
  const Vec3 warped =
      s +
      0.9 * Vec3{noise(0.8 * s + Vec3{11, 0, 0}), noise(0.8 * s + Vec3{0, 23, 0}), noise(0.8 * s + Vec3{0, 0, 37})} +
      0.25 * Vec3{noise(2.9 * s), noise(2.9 * s + Vec3{9, 9, 9}), noise(2.9 * s + Vec3{4, 8, 2})};
  const double much = smooth_step(-0.45, 0.45, noise(0.5 * s + Vec3{50, 20, 10}));
  const double breaks = noise(1.3 * s + Vec3{70, 1, 2});
  const double vein1 = std::abs(noise(0.8 * warped + Vec3{2, 40, 8}));
  const double vein2 = std::abs(noise(1.7 * warped + Vec3{60, 4, 1}));
  const double vein3 = std::abs(noise(3.6 * warped + Vec3{6, 34, 15}));
  double fat = smooth_step(0.085, 0.035, vein1 + 0.07 * (1 - much) + 0.09 * smooth_step(-0.2, 0.5, breaks));
  fat =
      std::max(fat, 0.95 * smooth_step(0.10, 0.04, vein2 + 0.10 * (1 - much) + 0.10 * smooth_step(-0.5, 0.3, -breaks)));
  fat = std::max(
      fat, 0.75 * smooth_step(0.12, 0.04, vein3 + 0.16 * (1 - much) + 0.08 * smooth_step(-0.5, 0.3, noise(2.1 * s))));
  const double island = noise(0.9 * warped + Vec3{90, 14, 55});
  fat = std::max(fat, smooth_step(0.80, 0.86, island + 0.10 * fibre));

  // The seam of fat around the eye of the meat, and the cap along the rim: thick on one side, a thin rind
  // elsewhere.
  const double length = 20 * size_;
  const double ring = hypotenuse(q.x + 0.16 * length, q.y + 0.07 * length) - 0.31 * length;
  const double open = smooth_step(0.0, 0.10 * length, q.x + 0.6 * q.y - 0.02 * length + 0.02 * length * noise(0.5 * s));
  const double seam = std::abs(ring + 0.012 * length * noise(0.7 * s + Vec3{8, 8, 1})) / (0.012 * length);
  fat = std::max(fat, open * smooth_step(1.15, 0.65, seam + 0.35 * fine * 0.3 + 0.3 * fibre));
  const double inside = distance_to_outline(q);
  const double towards = q.y / (10 * size_) * 0.9 - q.x / (10 * size_) * 0.45;
  const double cap =
      length * (0.009 + 0.050 * smooth_step(0.1, 0.75, towards)) * (1 + 0.25 * noise(0.6 * s + Vec3{1, 2, 3}));
  const double rind = smooth_step(1.08, 0.92, inside / cap + 0.05 * fine);
  fat = std::max(fat, rind);
  const Vec3 fat_color = mix({0.70, 0.53, 0.38}, {0.86, 0.73, 0.58}, 0.5 + 0.5 * fractal_noise(1.7 * s, 2));

  PictureSurface out;
  out.color = mix(red, fat_color, 0.93 * fat);
  out.roughness = wall ? 0.26 : 0.30 + 0.12 * fat;
  out.gloss = wall ? 0.05 : 0.04;
  out.bump = size_ * (0.020 * fibre + 0.0025 * fine + 0.012 * fat + 0.06 * tone);
  out.wrap = 0.35;
  return out;
}

PictureSurface BodyTexture::at(Vec3 rest, bool wall) const {
  const Vec3 d = rest - box_.center();
  const Vec3 q{d[axes_[0]], d[axes_[1]], d[axes_[2]]};
  const Vec3 s = (1 / size_) * q;
  PictureSurface out;
  switch (look_) {
    case Look::kMeat: return meat(q, rest, wall);
    case Look::kCartilage: {
      const double fibre = fractal_noise({0.9 * s.x, 0.9 * s.y, 5 * s.z}, 3);
      out.color = wall ? mix({0.55, 0.28, 0.22}, {0.72, 0.46, 0.38}, 0.5 + 0.7 * fibre)
                       : mix({0.50, 0.42, 0.32}, {0.68, 0.61, 0.50}, 0.5 + 0.7 * fibre);
      out.roughness = wall ? 0.38 : 0.28;
      out.gloss = 0.045;
      out.bump = size_ * 0.006 * fibre;
      out.wrap = 0.3;
      return out;
    }
    case Look::kSheet: {
      // A faint square grid, a line every twentieth of the body, shows how it is strained.
      const auto line = [&](double x) { return smooth_step(0.045, 0.02, std::abs(x - std::round(x))); };
      const double grid = std::max(line(s.x + 0.5), line(s.y + 0.5));
      out.color = wall ? Vec3{0.90, 0.36, 0.16} : mix({0.18, 0.42, 0.70}, {0.07, 0.20, 0.42}, 0.6 * grid);
      out.roughness = 0.5;
      out.gloss = 0.04;
      return out;
    }
  }
  return out;
}

PictureSurface thing_surface(PictureThing::Stuff stuff) {
  switch (stuff) {
    case PictureThing::Stuff::kSteel: return {{0.30, 0.31, 0.33}, 0.28, 0.45, 0, 0};
    case PictureThing::Stuff::kBone: return {{0.62, 0.56, 0.45}, 0.45, 0.04, 0, 0.2};
    case PictureThing::Stuff::kWood: return {{0.30, 0.17, 0.08}, 0.6, 0.03, 0, 0};
    case PictureThing::Stuff::kStone: break;
  }
  return {{0.46, 0.42, 0.36}, 0.6, 0.04, 0, 0};
}

double ground_outside(Look look, Vec2 p, double size) {
  if (look != Look::kMeat) return -1;
  const double half_x = 1.02 * size, half_y = 0.74 * size, round = 0.10 * size;
  const double x = std::max(0.0, std::abs(p.x) - half_x + round), y = std::max(0.0, std::abs(p.y) - half_y + round);
  return hypotenuse(x, y) - round;
}

PictureSurface ground_surface(Look look, Vec2 p, double size) {
  PictureSurface out;
  if (look != Look::kMeat) {
    out.color = look == Look::kSheet ? Vec3{0.55, 0.56, 0.57} : Vec3{0.045, 0.13, 0.15};
    const double weave = noise({p.x / size * 60, p.y / size * 60, 0});
    out.color = (1 + (look == Look::kSheet ? 0.01 : 0.05) * weave) * out.color;
    out.roughness = 0.8;
    return out;
  }
  const double plank_width = 0.27 * size;
  const double across = p.y / plank_width + 0.5;
  const double plank = std::floor(across), in_plank = across - plank;
  const double shift = 7.7 * plank;
  const double x = p.x / size, y = p.y / size;
  const double bend = 0.05 * noise({1.6 * x + shift, 3 * y, shift}) + 0.02 * noise({4 * x + shift, 9 * y, 2});
  const double rings = 26 * (y + bend) + 1.2 * noise({1.1 * x + shift, 2 * y, 5.5});
  const double grain = 0.5 + 0.5 * std::sin(2 * M_PI * rings * 0.5 + 1.5 * noise({2.2 * x, 18 * y, shift}));
  const double pores = noise({22 * x + shift, 420 * y, 1});
  const double tint = lattice_value(static_cast<std::int64_t>(plank), 3, 9);
  Vec3 wood = mix({0.150, 0.066, 0.027}, {0.285, 0.140, 0.060}, 0.25 + 0.6 * grain + 0.12 * tint);
  wood = (1 + 0.08 * pores + 0.06 * tint) * wood;
  const double seam = std::min(in_plank, 1 - in_plank) * plank_width / size;
  wood = mix({0.020, 0.010, 0.005}, wood, smooth_step(0.0006, 0.0030, seam));
  out.color = wood;
  out.roughness = 0.46 + 0.08 * pores;
  out.gloss = 0.035;
  out.bump = 0;
  return out;
}

}  // namespace kerf
