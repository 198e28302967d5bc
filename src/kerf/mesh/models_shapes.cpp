// Bodies that are harder than the paper's: slabs with holes, a thin-walled tube, a bent strip, an S.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kerf/mesh/models_planar.h"

namespace kerf::models {
namespace {

constexpr double kYoung = 5e4;  // Pa: soft rubber
constexpr double kPoisson = 0.4;
constexpr double kDensity = 1000;

/// A flat region as a function of a grid: coarse quads, each refined alike for the visual mesh.
struct GridRegion {
  int nx = 0, ny = 0;                         ///< coarse quads
  std::function<Vec2(double, double)> point;  ///< grid coordinates 0..nx, 0..ny to the plane, metres
  std::function<bool(int, int)> exists;       ///< coarse quad (i, j), or empty: all
  double thickness = 0;                       ///< metres
};

PlanarMesh refined(const GridRegion& region, int refinement) {
  const int nx = region.nx * refinement, ny = region.ny * refinement;
  auto exists = [&](int i, int j) {
    if (i < 0 || j < 0 || i >= nx || j >= ny) return false;
    return !region.exists || region.exists(i / refinement, j / refinement);
  };
  return quad_grid(
      nx, ny,
      [&](int i, int j) {
        return region.point(static_cast<double>(i) / refinement, static_cast<double>(j) / refinement);
      },
      [&](int i, int j) {
        if (!exists(i, j)) return QuadSplit::kNone;
        // At an outer corner the diagonal starts in the corner, so that no triangle has two border edges.
        const bool left = !exists(i - 1, j), right = !exists(i + 1, j), below = !exists(i, j - 1),
                   above = !exists(i, j + 1);
        if ((left && below) || (right && above)) return QuadSplit::kSlash;
        if ((right && below) || (left && above)) return QuadSplit::kBackslash;
        return (i + j) % 2 == 0 ? QuadSplit::kSlash : QuadSplit::kBackslash;
      });
}

[[maybe_unused]] std::size_t visual_count(const PlanarMesh& mesh, int rings) {
  std::size_t border = 0;
  for (const auto& loop : mesh.loops) border += loop.size();
  return 2 * mesh.triangles.size() + 2 * border * static_cast<std::size_t>(rings + 1);
}

constexpr std::size_t kDefaultTriangles = 6000;
constexpr std::size_t kMostTriangles = 4000000;

/// Thickens the region evenly; the visual mesh gets the refinement whose triangle count comes nearest to the wish.
Result<Model> make_slab(const GridRegion& region, const ModelOptions& options, std::string_view name, Vec3 cell) {
  const std::size_t wanted = options.visual_triangles == 0 ? kDefaultTriangles : options.visual_triangles;
  if (wanted > kMostTriangles)
    return bad_input(fmt::format("model {} has at most {} visual triangles, not {}", name, kMostTriangles, wanted));
  const PlanarMesh coarse = refined(region, 1);
  if (options.collision_triangles != 0 && options.collision_triangles != coarse.triangles.size())
    return bad_input(fmt::format("model {} has {} collision triangles, not {}", name, coarse.triangles.size(),
                                 options.collision_triangles));
  double edge = 0;  // mean border edge, for a rim of about square quads
  std::size_t border = 0;
  for (const auto& loop : coarse.loops)
    for (std::size_t i = 0; i < loop.size(); ++i, ++border)
      edge += norm(coarse.points[static_cast<std::size_t>(loop[(i + 1) % loop.size()])] -
                   coarse.points[static_cast<std::size_t>(loop[i])]);
  edge /= static_cast<double>(border);
  auto rings_of = [&](int r) {
    return std::max(1, 2 * static_cast<int>(std::lround(region.thickness * r / edge / 2)) - 1);
  };
  auto count_of = [&](int r) {
    const auto n = static_cast<std::size_t>(r);
    return 2 * n * n * coarse.triangles.size() + 2 * n * border * static_cast<std::size_t>(rings_of(r) + 1);
  };
  int refinement = 1;
  while (count_of(refinement + 1) <= wanted) ++refinement;
  if (wanted > count_of(refinement) && wanted - count_of(refinement) > count_of(refinement + 1) - wanted) ++refinement;

  ThickShape shape;
  const double half = region.thickness / 2;
  shape.top = [=](std::size_t) { return half; };
  shape.bottom = [=](std::size_t) { return -half; };
  shape.rim_rings = rings_of(refinement);
  const PlanarMesh fine = refined(region, refinement);
  KERF_ASSERT(visual_count(fine, shape.rim_rings) == count_of(refinement));
  Model model;
  model.closed = true;
  model.visual = thicken(fine, shape);
  model.collision = flat_surface(coarse);
  model.half_thickness.assign(coarse.points.size(), half);
  model.lattice = lattice_around(bounding_box(model.visual), cell);
  model.young = kYoung;
  model.poisson = kPoisson;
  model.density = kDensity;
  return model;
}

}  // namespace

Result<Model> make_holed_slab(const ModelOptions& options, int holes) {
  // 20 mm quads; every hole is 2 x 2 of them, with three or more between a hole and the next border.
  GridRegion region;
  region.nx = holes == 1 ? 8 : 13;
  region.ny = 8;
  region.thickness = 0.02;
  const int nx = region.nx, ny = region.ny;
  region.point = [=](double u, double v) { return Vec2{0.02 * (u - nx / 2.0), 0.02 * (v - ny / 2.0)}; };
  region.exists = [=](int i, int j) {
    const bool row = j == 3 || j == 4;
    return !(row && (i == 3 || i == 4 || (holes == 2 && (i == 8 || i == 9))));
  };
  return make_slab(region, options, holes == 1 ? "holed-slab" : "two-holed-slab", {0.02, 0.02, 0.02});
}

Result<Model> make_half_shell(const ModelOptions& options) {
  GridRegion region;
  region.nx = 16;
  region.ny = 6;
  region.thickness = 0.004;
  region.point = [](double u, double v) { return Vec2{0.16 * (u / 16 - 0.5), 0.06 * (v / 6 - 0.5)}; };
  Result<Model> model = make_slab(region, options, "half-shell", {0.01, 0.01, 0.01});
  if (!model) return model;
  KERF_TRY(bend(*model, M_PI));
  return model;
}

Result<Model> make_s_shape(const ModelOptions& options) {
  // Two arcs of 210 degrees and radius 40 mm, 24 mm wide, that continue each other.
  constexpr double kRadius = 0.04, kHalfWidth = 0.012, kArc = 210 * M_PI / 180;
  GridRegion region;
  region.nx = 36;
  region.ny = 3;
  region.thickness = 0.006;
  region.point = [](double u, double v) {
    const double s = (u / 36 - 0.5) * 2 * kArc;  // angle along the S from its middle, signed
    const double off = (2 * v / 3 - 1) * kHalfWidth;
    // From the middle, heading +y: the first half (s < 0) turns about (-R, 0), the second about (R, 0).
    const double side = s < 0 ? -1 : 1, a = std::abs(s);
    const Vec2 on{side * (kRadius - kRadius * std::cos(a)), side * kRadius * std::sin(a)};
    const Vec2 left{-std::cos(a), std::sin(a)};  // left of the heading (sin a, cos a), the same on both halves
    return on + off * left;
  };
  return make_slab(region, options, "s-shape", {0.006, 0.006, 0.006});
}

Result<Model> make_strip(const ModelOptions& options) {
  GridRegion region;
  region.nx = 25;
  region.ny = 3;
  region.thickness = 0.003;
  region.point = [](double u, double v) { return Vec2{0.2 * (u / 25 - 0.5), 0.024 * (v / 3 - 0.5)}; };
  return make_slab(region, options, "strip", {0.008, 0.008, 0.003});
}

Result<Model> make_mat(const ModelOptions& options) {
  GridRegion region;
  region.nx = 20;
  region.ny = 20;
  region.thickness = 0.003;
  region.point = [](double u, double v) { return Vec2{0.2 * (u / 20 - 0.5), 0.2 * (v / 20 - 0.5)}; };
  return make_slab(region, options, "mat", {0.01, 0.01, 0.003});
}

Result<Model> make_tube(const ModelOptions& options) {
  // Unrolled: x is the arc length at mid-wall, and the last column of quads ends at the first column of points.
  constexpr double kRadius = 0.03, kWall = 0.004, kLength = 0.10;
  constexpr int kAround = 24, kAlong = 12;
  if (options.collision_triangles != 0 && options.collision_triangles != 2 * kAround * kAlong)
    return bad_input(fmt::format("model tube has {} collision triangles, not {}", 2 * kAround * kAlong,
                                 options.collision_triangles));
  if (options.bend != 0) return bad_input("model tube is round already and can't be bent");
  const std::size_t wanted = options.visual_triangles == 0 ? kDefaultTriangles : options.visual_triangles;
  if (wanted > kMostTriangles)
    return bad_input(fmt::format("model tube has at most {} visual triangles, not {}", kMostTriangles, wanted));

  constexpr double kTurn = 2 * M_PI * kRadius;
  auto unrolled = [](int around, int along) {
    PlanarMesh mesh;
    for (int j = 0; j <= along; ++j)
      for (int i = 0; i < around; ++i)
        mesh.points.push_back({kTurn * i / around, kLength * (static_cast<double>(j) / along - 0.5)});
    for (int j = 0; j < along; ++j)
      for (int i = 0; i < around; ++i) {
        const int k = (i + 1) % around;
        const std::int32_t a = j * around + i, b = j * around + k, c = b + around, d = a + around;
        const auto& p = mesh.points;
        const Vec2 pa = p[static_cast<std::size_t>(a)], pd = p[static_cast<std::size_t>(d)];
        const Vec2 pb{kTurn * (i + 1) / around, pa.y}, pc{pb.x, pd.y};
        if ((i + j) % 2 == 0) {
          mesh.triangles.push_back({a, b, c});
          mesh.triangles.push_back({a, c, d});
          mesh.corners.push_back({pa, pb, pc});
          mesh.corners.push_back({pa, pc, pd});
        } else {
          mesh.triangles.push_back({a, b, d});
          mesh.triangles.push_back({b, c, d});
          mesh.corners.push_back({pa, pb, pd});
          mesh.corners.push_back({pb, pc, pd});
        }
      }
    find_loops(mesh);
    return mesh;
  };
  auto roll = [](TriangleMesh& mesh) {  // + side outside
    for (Vec3& p : mesh.positions) {
      const double angle = p.x / kRadius, r = kRadius + p.z;
      p = {r * std::sin(angle), p.y, r * std::cos(angle)};
    }
  };
  auto rings_of = [](int r) {
    return std::max(1, 2 * static_cast<int>(std::lround(kWall * kAround * r / kTurn / 2)) - 1);
  };
  auto count_of = [&](int r) {
    const int count = 4 * kAround * kAlong * r * r + 4 * kAround * r * (rings_of(r) + 1);
    return static_cast<std::size_t>(count);
  };
  int refinement = 1;
  while (count_of(refinement + 1) <= wanted) ++refinement;
  if (wanted > count_of(refinement) && wanted - count_of(refinement) > count_of(refinement + 1) - wanted) ++refinement;

  ThickShape shape;
  shape.top = [](std::size_t) { return kWall / 2; };
  shape.bottom = [](std::size_t) { return -kWall / 2; };
  shape.rim_rings = rings_of(refinement);
  Model model;
  model.closed = true;
  model.visual = thicken(unrolled(kAround * refinement, kAlong * refinement), shape);
  model.collision = flat_surface(unrolled(kAround, kAlong));
  roll(model.visual);
  roll(model.collision);
  model.half_thickness.assign(model.collision.positions.size(), kWall / 2);
  model.lattice = lattice_around(bounding_box(model.visual), {0.008, 0.01, 0.008});
  model.young = kYoung;
  model.poisson = kPoisson;
  model.density = kDensity;
  return model;
}

}  // namespace kerf::models
