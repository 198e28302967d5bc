// The thin sheets of both experiments, open as in the paper, and closed at any resolution.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kerf/mesh/models_planar.h"

namespace kerf::models {
namespace {

constexpr double kSide = 1.0;            // m
constexpr double kSheetThickness = 0.1;  // m
constexpr std::size_t kMostCollision = 120000;
constexpr double kMaxTriangles = 10.1e6;  // a closed sheet of "10 million" may round up a little

constexpr double kSheetYoung = 5e3;  // Pa
constexpr double kSheetPoisson = 0.3;
constexpr double kSheetDensity = 10;  // kg/m3: the whole sheet has 1 kg

void finish(Model& model, const PlanarMesh& collision) {
  model.collision = flat_surface(collision);
  model.half_thickness.assign(collision.points.size(), kSheetThickness / 2);
  constexpr int cells = 9;  // 81 cells, 200 nodes
  model.lattice.origin = {-kSide / 2, -kSide / 2, -kSheetThickness / 2};
  model.lattice.cell = {kSide / cells, kSide / cells, kSheetThickness};
  model.lattice.cells = {cells, cells, 1};
  model.young = kSheetYoung;
  model.poisson = kSheetPoisson;
  model.density = kSheetDensity;
}

/// i of n steps over a centred interval of the given length; both ends and the middle are exact.
double spread(int i, int n, double length) { return length * (static_cast<double>(2 * i - n) / (2.0 * n)); }

/// n of a grid of n x n quads, two triangles each.
int grid_side(std::size_t triangles) {
  return static_cast<int>(std::lround(std::sqrt(static_cast<double>(triangles) / 2)));
}

}  // namespace

bool offers_collision(std::size_t triangles) {
  if (triangles == 104 || triangles == 500 || triangles == 1500) return true;
  const auto n = static_cast<std::size_t>(grid_side(triangles));
  return n >= 4 && 2 * n * n == triangles && triangles <= kMostCollision;
}

PlanarMesh sheet_collision(std::size_t triangles) {
  if (triangles == 104) {
    return quad_grid(
        6, 6,
        [](int i, int j) {
          return Vec2{spread(i, 6, kSide), spread(j, 6, kSide)};
        },
        [](int i, int j) {
          const bool centre = i >= 1 && i <= 4 && j >= 1 && j <= 4;
          return centre ? QuadSplit::kCross : alternating_split(i, j, 6, 6);
        });
  }
  if (triangles != 500 && triangles != 1500) {
    const int n = grid_side(triangles);
    return quad_grid(
        n, n,
        [=](int i, int j) {
          return Vec2{spread(i, n, kSide), spread(j, n, kSide)};
        },
        [=](int i, int j) { return alternating_split(i, j, n, n); });
  }
  // nx + ny quads make half the border; every quad in the inside that is split in four adds two triangles.
  const int nx = triangles == 500 ? 14 : 22, ny = nx + 1;
  const int crosses = (static_cast<int>(triangles) - 2 * nx * ny) / 2;
  const int inner = (nx - 2) * (ny - 2);
  return quad_grid(
      nx, ny,
      [=](int i, int j) {
        return Vec2{spread(i, nx, kSide), spread(j, ny, kSide)};
      },
      [=](int i, int j) {
        if (i == 0 || j == 0 || i == nx - 1 || j == ny - 1) return alternating_split(i, j, nx, ny);
        const int k = (j - 1) * (nx - 2) + (i - 1);  // spread evenly over the inside
        return (k + 1) * crosses / inner > k * crosses / inner ? QuadSplit::kCross : alternating_split(i, j, nx, ny);
      });
}

Result<Model> make_sheet(const ModelOptions& options) {
  const std::size_t visual_count = options.visual_triangles == 0 ? 6656 : options.visual_triangles;
  const std::size_t collision_count = options.collision_triangles == 0 ? 104 : options.collision_triangles;
  if (visual_count != 1664 && visual_count != 6656 && visual_count != 26624 && visual_count != 106496)
    return bad_input(fmt::format("model sheet has 1664, 6656, 26624 or 106496 visual triangles, not {}", visual_count));
  PlanarMesh visual = sheet_collision(104);
  while (visual.triangles.size() < visual_count) visual = subdivide(visual);

  Model model;
  model.closed = false;
  model.visual = flat_surface(visual);
  if (collision_count == visual_count) {
    finish(model, visual);
  } else if (collision_count == 104 || collision_count == 500 || collision_count == 1500) {
    finish(model, sheet_collision(collision_count));
  } else {
    return bad_input(
        fmt::format("model sheet has 104, 500 or 1500 collision triangles, or as many as visual ones ({}), "
                    "not {}",
                    visual_count, collision_count));
  }
  return model;
}

Result<Model> make_closed_sheet(const ModelOptions& options) {
  const auto wanted = static_cast<double>(options.visual_triangles == 0 ? 20000 : options.visual_triangles);
  const std::size_t collision_count = options.collision_triangles == 0 ? 104 : options.collision_triangles;
  if (!offers_collision(collision_count))
    return bad_input(fmt::format(
        "model closed-sheet has 104, 500 or 1500 collision triangles or 2 n^2 of them (32, 50, 72 ... {}), not {}",
        kMostCollision, collision_count));
  if (wanted < 500 || wanted > kMaxTriangles)
    return bad_input(
        fmt::format("model closed-sheet has 500 to 10000000 visual triangles, not {}", options.visual_triangles));
  const double bulge = options.rim_radius;
  if (!(bulge >= 0 && bulge <= kSheetThickness / 2))
    return bad_input(
        fmt::format("the rim radius of model closed-sheet is 0 to {} m, not {}", kSheetThickness / 2, bulge));

  // 4 n^2 triangles on both sides and 8 n (rings + 1) on the rim, its quads about square.
  auto rings_of = [](int n) {
    return std::max(1, 2 * static_cast<int>(std::lround(n * kSheetThickness / kSide / 2)) - 1);
  };
  auto count_of = [&](int n) { return 4.0 * n * n + 8.0 * n * (rings_of(n) + 1); };
  int n = 4;
  while (count_of(n + 1) <= wanted) ++n;
  if (wanted - count_of(n) > count_of(n + 1) - wanted && count_of(n + 1) < kMaxTriangles) ++n;

  const double length = kSide - 2 * bulge;
  const PlanarMesh side = quad_grid(
      n, n,
      [=](int i, int j) {
        return Vec2{spread(i, n, length), spread(j, n, length)};
      },
      [=](int i, int j) { return alternating_split(i, j, n, n); });
  ThickShape shape;
  shape.top = [](std::size_t) { return kSheetThickness / 2; };
  shape.bottom = [](std::size_t) { return -kSheetThickness / 2; };
  shape.rim_rings = rings_of(n);
  if (bulge > 0) {
    shape.bulge = [&side, length, bulge](std::size_t i) {
      const Vec2 p = side.points[i];
      auto out = [=](double x) { return std::abs(x) < length / 2 ? 0.0 : std::copysign(bulge, x); };
      return Vec2{out(p.x), out(p.y)};
    };
  }
  Model model;
  model.closed = true;
  model.visual = thicken(side, shape);
  finish(model, sheet_collision(collision_count));
  return model;
}

}  // namespace kerf::models
