// A crescent wedge with the size, counts and material of the paper's meniscus.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kerf/mesh/models_planar.h"

namespace kerf::models {
namespace {

// Outlines in millimetres, x across the horns, y towards their tips. Each is an oval of exponent `power` whose upper half
// (towards the tips) has a height of its own.
struct Oval {
  double half_width, below, above, center_y, power;
};
constexpr Oval kOuter{22.5, 15.5, 20.5, 15.5, 2.8};
constexpr Oval kInner{8.3, 9.0, 20.0, 22.0, 2.2};
constexpr double kTipAngle = 0.70;                    // rad between the y axis and the end of a horn
constexpr double kTipBulge = 0.07;                    // rad by which the end is rounded
constexpr double kInnerHalf = 0.5, kOuterHalf = 2.0;  // mm: 1 mm thick inside, 4 mm at the outer wall
constexpr double kMillimetre = 1e-3;

// With q_s x q_r quads a side and k rings: 2 (q_s + 1)(q_r + 1) + 2 k (q_s + q_r) vertices = 2882.
constexpr int kAlong = 100, kAcross = 10, kRings = 3;
constexpr int kCollisionAlong = 20, kCollisionAcross = 4;  // 21 x 5 = 105 vertices, 160 triangles

Vec2 on(const Oval& oval, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  const double high = s > 0 ? oval.above : oval.below;
  const double r = std::pow(
      std::pow(std::abs(c) / oval.half_width, oval.power) + std::pow(std::abs(s) / high, oval.power), -1 / oval.power);
  return {r * c, oval.center_y + r * s};
}

/// The crescent: angle measured at the ovals' centres, across 0 at the outer wall, 1 at the inner edge.
Vec2 crescent(double angle, double across) { return lerp(on(kOuter, angle), on(kInner, angle), across); }

/// along 0..1 from one horn's tip to the other's, about even in arc length.
class Crescent {
 public:
  Crescent() {
    double length = 0;
    Vec2 last = crescent(angle_at(0), 0.5);
    for (std::size_t i = 0; i < kSteps; ++i) {
      const Vec2 p = crescent(angle_at(static_cast<double>(i) / (kSteps - 1)), 0.5);
      length += norm(p - last);
      last = p;
      length_[i] = length;
    }
  }
  [[nodiscard]] Vec2 operator()(double along, double across) const {
    const double wanted = along * length_.back();
    const auto it = std::lower_bound(length_.begin() + 1, length_.end() - 1, wanted);
    const auto i = static_cast<std::size_t>(it - length_.begin());
    const double part = (wanted - length_[i - 1]) / (length_[i] - length_[i - 1]);
    const double even = (static_cast<double>(i - 1) + part) / (kSteps - 1);
    const double rounding = kTipBulge * (1 - (2 * across - 1) * (2 * across - 1)) * (2 * even - 1);
    return kMillimetre * crescent(angle_at(even) + rounding, across);
  }

 private:
  static constexpr std::size_t kSteps = 2001;
  static double angle_at(double even) { return M_PI / 2 + kTipAngle + even * 2 * (M_PI - kTipAngle); }
  std::array<double, kSteps> length_{};
};

PlanarMesh crescent_grid(int along, int across) {
  const Crescent shape;
  auto point = [&](int i, int j) { return shape(static_cast<double>(i) / along, static_cast<double>(j) / across); };
  auto split = [&](int i, int j) {
    if ((i == 0 || i == along - 1) && (j == 0 || j == across - 1)) return alternating_split(i, j, along, across);
    const double slash = norm(point(i + 1, j + 1) - point(i, j)), backslash = norm(point(i, j + 1) - point(i + 1, j));
    return slash < backslash ? QuadSplit::kSlash : QuadSplit::kBackslash;
  };
  return quad_grid(along, across, point, split);
}

}  // namespace

Result<Model> make_meniscus(const ModelOptions& options) {
  if (options.visual_triangles != 0 && options.visual_triangles != 5760)
    return bad_input(fmt::format("model meniscus has 5760 visual triangles, not {}", options.visual_triangles));
  if (options.collision_triangles != 0 && options.collision_triangles != 160)
    return bad_input(fmt::format("model meniscus has 160 collision triangles, not {}", options.collision_triangles));
  // Rows of the grid: half thickness by how far across vertex i is.
  auto half = [](std::size_t i, int along, int across) {
    const std::size_t row = i / static_cast<std::size_t>(along + 1);
    const double t = static_cast<double>(row) / across;
    return kMillimetre * (kOuterHalf + t * (kInnerHalf - kOuterHalf));
  };
  ThickShape shape;
  shape.top = [=](std::size_t i) { return half(i, kAlong, kAcross); };
  shape.bottom = [=](std::size_t i) { return -half(i, kAlong, kAcross); };
  shape.rim_rings = kRings;

  Model model;
  model.closed = true;
  model.visual = thicken(crescent_grid(kAlong, kAcross), shape);
  const PlanarMesh collision = crescent_grid(kCollisionAlong, kCollisionAcross);
  model.collision = flat_surface(collision);
  for (std::size_t i = 0; i < collision.points.size(); ++i)
    model.half_thickness.push_back(half(i, kCollisionAlong, kCollisionAcross));
  // 8 x 6 cells but for the 2 x 3 between the horns: 42 cells, 60 corners in the plane.
  const double cell = 2 * kOuter.half_width * kMillimetre / 8;
  model.lattice.origin = {-4 * cell, 0, -kOuterHalf * kMillimetre};
  model.lattice.cell = {cell, cell, 2 * kOuterHalf * kMillimetre};
  model.lattice.cells = {8, 6, 1};
  model.young = 3.85e6;
  model.poisson = 0.29;
  model.density = 1090;
  return model;
}

}  // namespace kerf::models
