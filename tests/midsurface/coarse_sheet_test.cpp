// The collision mesh of a sheet that is drawn finely: judged by the formulas that made the sheet, not by the sheet's triangles.
#include "kerf/midsurface/coarse_sheet.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kerf/base/random.h"
#include "kerf/binding/bind.h"
#include "kerf/binding/validate_binding.h"
#include "kerf/mesh/surface_measures.h"

namespace kerf::coarse_sheet_test {
namespace {

constexpr double kThickness = 0.004;

/// n x m fields over the unit square, less those of which hole(u, v) is true.
template <class Place, class Hole>
TriangleMesh sheet(int n, int m, Place&& place, Hole&& hole) {
  TriangleMesh out;
  for (int j = 0; j <= m; ++j)
    for (int i = 0; i <= n; ++i) out.positions.push_back(place(static_cast<double>(i) / n, static_cast<double>(j) / m));
  for (int j = 0; j < m; ++j)
    for (int i = 0; i < n; ++i) {
      if (hole((i + 0.5) / n, (j + 0.5) / m)) continue;
      const std::int32_t a = j * (n + 1) + i;
      out.triangles.push_back({VertexId(a), VertexId(a + 1), VertexId(a + n + 2)});
      out.triangles.push_back({VertexId(a), VertexId(a + n + 2), VertexId(a + n + 1)});
    }
  return out;
}
constexpr auto kWhole = [](double, double) { return false; };
constexpr auto kFlat = [](double u, double v) { return Vec3{0.2 * u, 0.1 * v, 0}; };

double area(const TriangleMesh& mesh) {
  double out = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3 a = mesh.positions[t[0]];
    out += 0.5 * norm(cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a));
  }
  return out;
}
double smallest_angle(const TriangleMesh& mesh) {
  double out = std::numbers::pi;
  for (const auto& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 p = mesh.positions[t[k]], a = mesh.positions[t[(k + 1) % 3]] - p,
                 b = mesh.positions[t[(k + 2) % 3]] - p;
      out = std::min(out, std::acos(std::clamp(dot(a, b) / (norm(a) * norm(b)), -1.0, 1.0)));
    }
  return out;
}
/// The visual sheet binds to the coarse one, and every check of a binding holds.
void expect_binds(const TriangleMesh& fine, const TriangleMesh& coarse) {
  BindOptions options;
  options.thickness = kThickness;
  const auto bound = bind(fine, coarse, options);
  ASSERT_TRUE(bound.ok()) << bound.error().message;
  const auto sound = validate_binding(bound->complex);
  EXPECT_TRUE(sound.ok()) << sound.error().message;
}

TEST(CoarseSheet, AFlatOneKeepsItsAreaAndCorners) {
  const TriangleMesh fine = sheet(120, 60, kFlat, kWhole);
  const auto coarse = make_coarse_sheet(fine, kThickness);
  ASSERT_TRUE(coarse.ok()) << coarse.error().message;
  EXPECT_NEAR(static_cast<double>(coarse->triangles.size()), 160, 30);
  EXPECT_NEAR(area(*coarse), 0.2 * 0.1, 1e-12) << "corners and straight sides stay";
  for (const Vec3 p : coarse->positions) EXPECT_NEAR(p.z, 0, 1e-15);
  EXPECT_GT(smallest_angle(*coarse), 0.35) << "20 degrees";
  expect_binds(fine, *coarse);
}

TEST(CoarseSheet, ABentOneStaysWithinAFifthOfTheHalfThickness) {
  constexpr double kRadius = 0.03;
  const TriangleMesh fine = sheet(
      200, 60,
      [](double u, double v) {
        return Vec3{kRadius * std::cos(5 * u), kRadius * std::sin(5 * u), 0.1 * v};
      },
      kWhole);
  const auto coarse = make_coarse_sheet(fine, kThickness);
  ASSERT_TRUE(coarse.ok()) << coarse.error().message;
  EXPECT_TRUE(!is_too_fine(coarse->triangles.size()));
  double off = 0;
  for (const auto& t : coarse->triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 m = lerp(coarse->positions[t[k]], coarse->positions[t[(k + 1) % 3]], 0.5);
      off = std::max(off, std::fabs(std::hypot(m.x, m.y) - kRadius));
    }
  EXPECT_LT(off, 1.5 * 0.2 * 0.5 * kThickness) << "edges are up to kSplit times as long as wanted";
  EXPECT_NEAR(area(*coarse), 5 * kRadius * 0.1, 0.01 * 5 * kRadius * 0.1);
  expect_binds(fine, *coarse);
}

TEST(CoarseSheet, HolesStay) {
  const TriangleMesh fine = sheet(80, 80, kFlat, [](double u, double v) {
    return std::hypot(u - 0.3, v - 0.5) < 0.12 || std::hypot(u - 0.7, v - 0.5) < 0.06;
  });
  const auto coarse = make_coarse_sheet(fine, kThickness);
  ASSERT_TRUE(coarse.ok()) << coarse.error().message;
  const SurfaceMeasures was = surface_measures(fine), now = surface_measures(*coarse);
  // Euler's number tells how many holes a connected sheet has.
  const auto euler = [](const TriangleMesh& m, const SurfaceMeasures& s) {
    std::vector<char> used(m.positions.size());
    for (const auto& t : m.triangles)
      for (const VertexId v : t) used[static_cast<std::size_t>(v.value)] = 1;
    return std::count(used.begin(), used.end(), 1) - static_cast<std::ptrdiff_t>(s.edges) +
           static_cast<std::ptrdiff_t>(m.triangles.size());
  };
  EXPECT_EQ(euler(fine, was), -1);
  EXPECT_EQ(euler(*coarse, now), -1);
  EXPECT_NEAR(area(*coarse), area(fine), 0.02 * area(fine));
  expect_binds(fine, *coarse);
}

TEST(CoarseSheet, RoughnessIsNoBend) {
  Random random(7);
  const TriangleMesh fine = sheet(
      150, 75,
      [&](double u, double v) {
        return kFlat(u, v) + Vec3{0, 0, random.uniform(0, 0.02 * kThickness)};
      },
      kWhole);
  const auto coarse = make_coarse_sheet(fine, kThickness);
  ASSERT_TRUE(coarse.ok()) << coarse.error().message;
  EXPECT_LT(coarse->triangles.size(), 700u);
  expect_binds(fine, *coarse);
}

TEST(CoarseSheet, AsManyTrianglesAsAreAskedFor) {
  const TriangleMesh fine = sheet(60, 30, kFlat, kWhole);
  for (const std::size_t wanted : {80, 400, 1200}) {
    MidsurfaceOptions options;
    options.triangles = wanted;
    const auto coarse = make_coarse_sheet(fine, kThickness, options);
    ASSERT_TRUE(coarse.ok()) << coarse.error().message;
    EXPECT_NEAR(static_cast<double>(coarse->triangles.size()), static_cast<double>(wanted),
                0.12 * static_cast<double>(wanted));
    expect_binds(fine, *coarse);
  }
}

TEST(CoarseSheet, IsTheSameEveryTime) {
  const TriangleMesh fine = sheet(100, 50, kFlat, kWhole);
  const auto a = make_coarse_sheet(fine, kThickness), b = make_coarse_sheet(fine, kThickness);
  ASSERT_TRUE(a.ok() && b.ok());
  ASSERT_EQ(a->positions.size(), b->positions.size());
  for (std::size_t v = 0; v < a->positions.size(); ++v) EXPECT_EQ(a->positions.raw()[v], b->positions.raw()[v]);
}

TEST(CoarseSheet, AClosedSurfaceIsRefused) {
  TriangleMesh tetrahedron;
  for (const Vec3 p : {Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}}) tetrahedron.positions.push_back(p);
  for (const auto& t : {std::array{0, 2, 1}, std::array{0, 1, 3}, std::array{1, 2, 3}, std::array{0, 3, 2}})
    tetrahedron.triangles.push_back({VertexId(t[0]), VertexId(t[1]), VertexId(t[2])});
  const auto refused = make_coarse_sheet(tetrahedron, kThickness);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("no sheet"), std::string::npos);
}

}  // namespace
}  // namespace kerf::coarse_sheet_test
