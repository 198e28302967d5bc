// A rib-eye steak with the counts of the paper's.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kerf/base/hypotenuse.h"
#include "kerf/mesh/models_planar.h"

namespace kerf::models {
namespace {

constexpr double kLength = 0.200, kWidth = 0.160, kThickness = 0.020;  // m
constexpr int kCollisionBorder = 31;
// With b border and i inner vertices on a side and k rings: 2 (b + i) + k b = 2641. The rim has three vertices per
// collision border edge, and the middle one of its rings lies on the outline.
constexpr int kBorder = 3 * kCollisionBorder, kInside = 1088, kBorderRings = 3;
static_assert(2 * (kBorder + kInside) + kBorderRings * kBorder == 2641);
constexpr double kRimBulge = 0.0065;  // m: the fat rim is rounded over this width
constexpr double kRimHalf = 0.0068;   // m: half thickness where the faces meet the rim
constexpr double kDomeWidth = 0.030;  // m from the rim over which the faces rise to full thickness

// Control polygon (mm) of the outline, a closed cubic B-spline, counter-clockwise from the tail. The eye of the meat is on
// the left, the tail on the right below, the notch between them on top.
constexpr std::array<Vec2, 19> kControl{{
    {104, -24}, {104, 10},  {100, 43},   {80, 66},    {56, 74},   {36, 60},   {16, 88}, {-28, 92}, {-64, 91}, {-97, 84},
    {-109, 54}, {-110, 14}, {-107, -26}, {-108, -62}, {-90, -88}, {-44, -89}, {4, -85}, {50, -90}, {86, -73},
}};

Vec2 spline(double t) {  // t in 0 .. number of control points
  const auto n = kControl.size();
  const auto i = static_cast<std::size_t>(std::floor(t));
  const double u = t - std::floor(t);
  const Vec2 a = kControl[(i + n - 1) % n], b = kControl[i % n], c = kControl[(i + 1) % n], d = kControl[(i + 2) % n];
  return ((1 - u) * (1 - u) * (1 - u) / 6) * a + ((3 * u * u * u - 6 * u * u + 4) / 6) * b +
         ((-3 * u * u * u + 3 * u * u + 3 * u + 1) / 6) * c + (u * u * u / 6) * d;
}

/// `count` points at equal steps along the outline, in a box of kLength x kWidth about the origin.
std::vector<Vec2> outline_points(int count) {
  constexpr int kFine = 4000;
  std::vector<Vec2> fine;
  Vec2 lo{HUGE_VAL, HUGE_VAL}, hi{-HUGE_VAL, -HUGE_VAL};
  for (int i = 0; i < kFine; ++i) {
    const Vec2 p = spline(static_cast<double>(kControl.size()) * i / kFine);
    fine.push_back(p);
    lo = {std::min(lo.x, p.x), std::min(lo.y, p.y)};
    hi = {std::max(hi.x, p.x), std::max(hi.y, p.y)};
  }
  const Vec2 middle = 0.5 * (lo + hi);
  for (Vec2& p : fine) p = {(p.x - middle.x) * kLength / (hi.x - lo.x), (p.y - middle.y) * kWidth / (hi.y - lo.y)};
  std::vector<double> along{0};
  for (std::size_t i = 0; i < fine.size(); ++i)
    along.push_back(along.back() + norm(fine[(i + 1) % fine.size()] - fine[i]));
  std::vector<Vec2> out;
  std::size_t i = 0;
  for (int k = 0; k < count; ++k) {
    const double s = along.back() * k / count;
    while (along[i + 1] <= s) ++i;
    out.push_back(lerp(fine[i], fine[(i + 1) % fine.size()], (s - along[i]) / (along[i + 1] - along[i])));
  }
  return out;
}

double distance_to(const std::vector<Vec2>& loop, Vec2 p) {
  double best = HUGE_VAL;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Vec2 a = loop[i], e = loop[(i + 1) % loop.size()] - a;
    const double t = std::clamp(dot(p - a, e) / dot(e, e), 0.0, 1.0);
    best = std::min(best, norm(p - (a + t * e)));
  }
  return best;
}

/// Height of a face over the middle plane, before scaling to the steak's thickness. `side` is +1 or -1: the faces differ.
double relief(Vec2 p, double from_rim, int side) {
  const double s = std::clamp(from_rim / kDomeWidth, 0.0, 1.0), rise = s * (2 - s);
  const double x = 1e3 * p.x, y = 1e3 * p.y;  // mm
  double z = 9.4 + 0.45 * std::sin(0.043 * x + 0.02 * y + side) + 0.45 * std::sin(0.071 * y - 0.03 * x + 2.1 * side) +
             0.35 * std::sin(0.11 * x + 0.083 * y * side);
  // The furrow of fat that runs from the notch around the eye of the meat.
  const double furrow = hypotenuse(x + 32, y + 14) - 62;
  const double open = std::clamp((x + 0.6 * y - 5) / 30, 0.0, 1.0);
  z -= (side > 0 ? 2.2 : 1.4) * open * std::exp(-furrow * furrow / 50);
  // Dents of the outer fat.
  z -= (side > 0 ? 1.3 : 0.8) * std::exp(-((x - 58) * (x - 58) + (y + 42) * (y + 42)) / 260);
  return 1e3 * kRimHalf + (z - 1e3 * kRimHalf) * rise;
}

}  // namespace

Result<Model> make_steak(const ModelOptions& options) {
  if (options.visual_triangles != 0 && options.visual_triangles != 5278)
    return bad_input(fmt::format("model steak has 5278 visual triangles, not {}", options.visual_triangles));
  const std::size_t collision_count = options.collision_triangles == 0 ? 137 : options.collision_triangles;
  if (collision_count != 67 && collision_count != 137)
    return bad_input(fmt::format("model steak has 67 or 137 collision triangles, not {}", collision_count));

  const std::vector<Vec2> outline = outline_points(kBorder);
  std::vector<Vec2> bulge, inset;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vec2 e = outline[(i + 1) % outline.size()] - outline[(i + outline.size() - 1) % outline.size()];
    bulge.push_back((kRimBulge / norm(e)) * Vec2{e.y, -e.x});
    inset.push_back(outline[i] - bulge[i]);
  }
  const PlanarMesh face = triangulate(inset, kInside);

  std::vector<double> top, bottom;
  double high = 0, low = 0;
  for (const Vec2 p : face.points) {
    const double d = distance_to(inset, p);
    top.push_back(relief(p, d, 1));
    bottom.push_back(-relief(p, d, -1));
    high = std::max(high, top.back());
    low = std::min(low, bottom.back());
  }
  // Both faces touch the planes at +- half the thickness; the rim stays at its own height.
  auto scaled = [](double z, double extreme) {
    const double rim = 1e3 * kRimHalf, full = 1e3 * kThickness / 2;
    const double s = z < 0 ? -1.0 : 1.0, a = std::abs(z);
    return s * 1e-3 * (a <= rim ? a : rim + (a - rim) * (full - rim) / (std::abs(extreme) - rim));
  };
  ThickShape shape;
  shape.top = [&](std::size_t i) { return scaled(top[i], high); };
  shape.bottom = [&](std::size_t i) { return scaled(bottom[i], low); };
  shape.bulge = [&](std::size_t i) { return bulge[i]; };
  shape.rim_rings = kBorderRings;

  Model model;
  model.closed = true;
  model.visual = thicken(face, shape);
  const PlanarMesh collision = triangulate(outline_points(kCollisionBorder), collision_count == 67 ? 19 : 54);
  model.collision = flat_surface(collision);
  for (std::size_t i = 0; i < collision.points.size(); ++i) {
    const Vec2 p = collision.points[i];
    if (i < kCollisionBorder) {
      model.half_thickness.push_back(kRimHalf);
    } else {
      const double d = distance_to(inset, p);
      model.half_thickness.push_back(0.5 * (scaled(relief(p, d, 1), high) - scaled(-relief(p, d, -1), low)));
    }
  }
  // 10 x 8 cells but for four at the corners: 76 cells, 95 corners in the plane.
  model.lattice.origin = {-kLength / 2, -kWidth / 2, -kThickness / 2};
  model.lattice.cell = {kLength / 10, kWidth / 8, kThickness};
  model.lattice.cells = {10, 8, 1};
  model.young = 2e4;  // raw muscle across its fibres
  model.poisson = 0.45;
  model.density = 1060;
  return model;
}

}  // namespace kerf::models
