#include "kerf/mesh/surface_check.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>

#include "kerf/base/random.h"
#include "kerf/mesh/half_edge_build.h"
#include "kerf/mesh/lips.h"
#include "kerf/mesh/mesh_file.h"
#include "kerf/mesh/nested_boxes.h"
#include "kerf/mesh/surface_measures.h"
#include "kerf/mesh/surface_tolerances.h"
#include "support/slit_plate.h"
#include "support/source_dir.h"

namespace kerf::surface_check_test {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::array<VertexId, 3> tri(int a, int b, int c) { return {VertexId(a), VertexId(b), VertexId(c)}; }

// A box with outward triangles: 8 vertices, 12 triangles; corner c is at bits (x = c & 1, y = c >> 1 & 1, z =
// c >> 2).
TriangleMesh box_mesh(Vec3 low = {0, 0, 0}, Vec3 high = {1, 1, 1}) {
  TriangleMesh mesh;
  for (int c = 0; c < 8; ++c) {
    mesh.positions.push_back(
        {(c & 1) != 0 ? high.x : low.x, (c & 2) != 0 ? high.y : low.y, (c & 4) != 0 ? high.z : low.z});
  }
  const int quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& q : quads) {
    mesh.triangles.push_back(tri(q[0], q[1], q[2]));
    mesh.triangles.push_back(tri(q[0], q[2], q[3]));
  }
  return mesh;
}

// A flat n x m grid of squares in the unit square, facing up.
TriangleMesh grid_mesh(int n, int m) {
  TriangleMesh mesh;
  for (int j = 0; j <= m; ++j) {
    for (int i = 0; i <= n; ++i) mesh.positions.push_back({static_cast<double>(i) / n, static_cast<double>(j) / m, 0});
  }
  for (int j = 0; j < m; ++j) {
    for (int i = 0; i < n; ++i) {
      const int a = j * (n + 1) + i;
      mesh.triangles.push_back(tri(a, a + 1, a + n + 2));
      mesh.triangles.push_back(tri(a, a + n + 2, a + n + 1));
    }
  }
  return mesh;
}

// A band of n squares whose ends are joined after `half_turns` half turns.
TriangleMesh band_mesh(int n, int half_turns) {
  TriangleMesh mesh;
  for (int i = 0; i < n; ++i) {
    const double a = 2 * std::numbers::pi * i / n;
    const double b = half_turns * a / 2;
    for (const double s : {-0.3, 0.3}) {
      const double r = 1 + s * std::cos(b);
      mesh.positions.push_back({r * std::cos(a), r * std::sin(a), s * std::sin(b)});
    }
  }
  for (int i = 0; i < n; ++i) {
    const int a = 2 * i;
    const int b = 2 * i + 1;
    const bool last = i == n - 1;
    const int c = last ? (half_turns % 2 != 0 ? 1 : 0) : a + 2;
    const int d = last ? (half_turns % 2 != 0 ? 0 : 1) : b + 2;
    mesh.triangles.push_back(tri(a, c, b));
    mesh.triangles.push_back(tri(b, c, d));
  }
  return mesh;
}

TriangleMesh torus_mesh(int n, int m, double big, double small) {
  TriangleMesh mesh;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < m; ++j) {
      const double a = 2 * std::numbers::pi * i / n;
      const double b = 2 * std::numbers::pi * j / m;
      mesh.positions.push_back(
          {(big + small * std::cos(b)) * std::cos(a), (big + small * std::cos(b)) * std::sin(a), small * std::sin(b)});
    }
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < m; ++j) {
      const int a = i * m + j;
      const int b = (i + 1) % n * m + j;
      const int c = (i + 1) % n * m + (j + 1) % m;
      const int d = i * m + (j + 1) % m;
      mesh.triangles.push_back(tri(a, b, c));
      mesh.triangles.push_back(tri(a, c, d));
    }
  }
  return mesh;
}

void append(TriangleMesh& mesh, const TriangleMesh& other) {
  const auto offset = static_cast<int>(mesh.positions.size());
  for (const Vec3& p : other.positions) mesh.positions.push_back(p);
  for (const auto& t : other.triangles)
    mesh.triangles.push_back(tri(t[0].value + offset, t[1].value + offset, t[2].value + offset));
}

void invert(TriangleMesh& mesh) {
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
}

// Every triangle with corners of its own, as STL files are.
TriangleMesh soup(const TriangleMesh& mesh) {
  TriangleMesh out;
  for (const auto& t : mesh.triangles) {
    const auto n = static_cast<int>(out.positions.size());
    for (const VertexId v : t) out.positions.push_back(mesh.positions[v]);
    out.triangles.push_back(tri(n, n + 1, n + 2));
  }
  return out;
}

SurfaceRequirements closed() {
  SurfaceRequirements r;
  r.closedness = Closedness::kClosed;
  return r;
}

// What is promised about every accepted surface, checked by the builder of half-edges.
void expect_sound(const TriangleMesh& mesh) {
  std::vector<std::array<std::int32_t, 3>> triangles;
  for (const auto& t : mesh.triangles) triangles.push_back({t[0].value, t[1].value, t[2].value});
  const auto half_edges = build_half_edges(triangles, mesh.positions.size());
  ASSERT_TRUE(half_edges.ok()) << half_edges.error().message;
  for (const std::int32_t h : half_edges->outgoing) EXPECT_GE(h, 0) << "an unused vertex is left";
}

SurfaceReport accepted(TriangleMesh& mesh, const SurfaceRequirements& requirements = {}) {
  auto report = check_surface(mesh, requirements);
  EXPECT_TRUE(report.ok()) << report.error().message;
  if (!report.ok()) return {};
  expect_sound(mesh);
  // A checked surface needs no further repair.
  TriangleMesh again = mesh;
  const auto second = check_surface(again, requirements);
  EXPECT_TRUE(second.ok() && second->repairs.empty());
  EXPECT_EQ(again.triangles, mesh.triangles);
  return *report;
}

std::string refused(const TriangleMesh& mesh, const SurfaceRequirements& requirements = {}) {
  TriangleMesh copy = mesh;
  const auto report = check_surface(copy, requirements);
  EXPECT_FALSE(report.ok());
  EXPECT_EQ(copy.triangles, mesh.triangles) << "a refused surface must stay as it was";
  return report.ok() ? "" : report.error().message;
}

// A wheel: a hub with so many triangles around it.
TriangleMesh wheel_mesh(int spokes) {
  TriangleMesh mesh;
  mesh.positions.push_back({});
  for (int i = 0; i < spokes; ++i) {
    const double a = 2 * std::numbers::pi * i / spokes;
    mesh.positions.push_back({std::cos(a), std::sin(a), 0});
    mesh.triangles.push_back(tri(0, i + 1, (i + 1) % spokes + 1));
  }
  return mesh;
}

TEST(SurfaceCheck, WheelsAreFineButTooLargeToBind) {
  TriangleMesh mesh = wheel_mesh(50000);
  accepted(mesh);
  SurfaceRequirements bindable;
  bindable.bindable = true;
  EXPECT_THAT(refused(mesh, bindable), AllOf(HasSubstr("vertex 1 at (0, 0, 0) has 50000 triangles around it"),
                                             HasSubstr("5000 are the most"), HasSubstr("re-mesh")));
  mesh = wheel_mesh(static_cast<int>(kMostAround));
  accepted(mesh, bindable);
}

// A hundred thousand groups may be as many bodies. 11 s where each is compared with all.
TEST(SurfaceCheck, AHundredThousandBodies) {
  constexpr int kBodies = 100000;
  TriangleMesh mesh;
  for (int i = 0; i < kBodies; ++i) {
    const Vec3 o{2.0 * (i % 100), 2.0 * (i / 100 % 100), 2.0 * (i / 10000)};
    for (const Vec3 p : {Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}}) mesh.positions.push_back(o + p);
    for (const auto& t : {tri(0, 2, 1), tri(0, 1, 3), tri(1, 2, 3), tri(2, 0, 3)})
      mesh.triangles.push_back(tri(4 * i + t[0].value, 4 * i + t[1].value, 4 * i + t[2].value));
  }
  SurfaceRequirements any;
  any.single_body = false;
  const auto report = check_surface(mesh, any);
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->bodies, std::size_t{kBodies});
  EXPECT_EQ(report->cavities, 0U);
}

// Every triangle has corners of its own: the hub is there 50,000 times. 7 s where those are compared with each other.
TEST(SurfaceCheck, ASoupAroundOnePlaceIsWelded) {
  constexpr int kSpokes = 50000;
  const TriangleMesh wheel = wheel_mesh(kSpokes);
  TriangleMesh soup;
  for (const auto& t : wheel.triangles) {
    const int first = static_cast<int>(soup.positions.size());
    for (const VertexId v : t) soup.positions.push_back(wheel.positions[v]);
    soup.triangles.push_back(tri(first, first + 1, first + 2));
  }
  SurfaceRequirements tolerant;
  tolerant.weld_tolerance = kWeldTolerance;
  const auto report = check_surface(soup, tolerant);
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(soup.positions.size(), std::size_t{kSpokes + 1});
}

TEST(NestedBoxes, FindsWhatLookingAtEachFinds) {
  Random random(11);
  for (int round = 0; round < 50; ++round) {
    const int n = random.index(60);
    std::vector<NestedBoxes::Item> items;
    for (int i = 0; i < n; ++i) {
      Box3 box;
      for (int k = 0; k < 2; ++k)
        box.add({1.0 * random.index(6), 1.0 * random.index(6), 1.0 * random.index(6)});  // many share sides
      items.push_back({box, static_cast<std::size_t>(i)});
    }
    const NestedBoxes boxes(items);
    for (const auto& in : items) {
      std::vector<std::size_t> found, expected;
      boxes.for_each_around(in.box, [&](std::size_t j) { found.push_back(j); });
      for (const auto& out : items) {
        Box3 both = out.box;
        both.add(in.box.min);
        both.add(in.box.max);
        if (both.min == out.box.min && both.max == out.box.max) expected.push_back(out.number);
      }
      std::sort(found.begin(), found.end());
      EXPECT_EQ(found, expected);
    }
  }
}

// Each is free once the one after it has gone: from the last to the first.
TEST(SurfaceCheck, ARowOfFlatTrianglesGoesFromItsFreeEnd) {
  constexpr int kFlat = 20000;
  TriangleMesh mesh;
  for (int i = 0; i <= kFlat + 1; ++i) mesh.positions.push_back({static_cast<double>(i), 0, 0});
  mesh.positions.push_back({0, 1, 0});
  mesh.triangles.push_back(tri(1, 0, kFlat + 2));
  for (int i = 1; i <= kFlat; ++i) mesh.triangles.push_back(tri(0, i, i + 1));
  EXPECT_THAT(accepted(mesh).repairs,
              ElementsAre("dropped 20000 triangles without area", "dropped 20000 vertices that no triangle uses"));
  EXPECT_EQ(mesh.triangles.size(), 1U);
}

TEST(SurfaceCheck, FlatTrianglesOnOneEdgeGo) {
  constexpr int kFlat = 50000;
  TriangleMesh mesh;
  mesh.positions.push_back({0, 0, 0});
  mesh.positions.push_back({1, 0, 0});
  mesh.positions.push_back({0, 1, 0});
  mesh.triangles.push_back(tri(0, 1, 2));
  for (int i = 0; i < kFlat; ++i) {
    mesh.positions.push_back({(i + 1.0) / (kFlat + 1), 0, 0});
    mesh.triangles.push_back(tri(0, 1, 3 + i));
  }
  EXPECT_THAT(accepted(mesh).repairs,
              ElementsAre("dropped 50000 triangles without area", "dropped 50000 vertices that no triangle uses"));
}

TEST(SurfaceMeasures, ClosedForms) {
  const SurfaceMeasures box = surface_measures(box_mesh({1, 2, 3}, {3, 5, 7}));
  EXPECT_NEAR(box.volume, 24, 1e-12);
  EXPECT_NEAR(box.area, 2 * (6 + 8 + 12), 1e-12);
  EXPECT_EQ(box.euler, 2);
  EXPECT_EQ(box.edges, 18u);
  EXPECT_TRUE(box.closed);
  EXPECT_EQ(box.components, 1u);

  const SurfaceMeasures torus = surface_measures(torus_mesh(400, 200, 2, 0.5));
  EXPECT_EQ(torus.euler, 0);
  EXPECT_NEAR(torus.volume, 2 * std::numbers::pi * std::numbers::pi * 2 * 0.25, 3e-3);
  EXPECT_NEAR(torus.area, 4 * std::numbers::pi * std::numbers::pi * 2 * 0.5, 5e-3);

  const SurfaceMeasures grid = surface_measures(grid_mesh(4, 3));
  EXPECT_EQ(grid.border_loops, 1u);
  EXPECT_EQ(grid.border_edges, 14u);
  EXPECT_EQ(grid.euler, 1);
  EXPECT_NEAR(grid.area, 1, 1e-15);
  EXPECT_EQ(grid.volume, 0);
  EXPECT_FALSE(grid.closed);

  const SurfaceMeasures band = surface_measures(band_mesh(12, 0));
  EXPECT_EQ(band.border_loops, 2u);
  EXPECT_EQ(band.euler, 0);
  EXPECT_EQ(surface_measures(band_mesh(12, 1)).border_loops, 1u);
  EXPECT_EQ(surface_measures(band_mesh(12, 1)).unoriented_edges, 1u);

  const MeshInfo info = mesh_info(grid_mesh(4, 4));
  EXPECT_DOUBLE_EQ(info.shortest_edge, 0.25);
  EXPECT_DOUBLE_EQ(info.longest_edge, 0.25 * std::sqrt(2.0));
  EXPECT_DOUBLE_EQ(info.smallest_area, 1.0 / 32);
  EXPECT_DOUBLE_EQ(info.largest_area, 1.0 / 32);
  EXPECT_NEAR(info.mean_edge, (40 * 0.25 + 16 * 0.25 * std::sqrt(2.0)) / 56, 1e-15);
  EXPECT_EQ(info.groups, 1u);
}

TEST(SurfaceCheck, SoundSurfacesStayAsTheyAre) {
  for (const TriangleMesh& good :
       {box_mesh(), grid_mesh(5, 4), torus_mesh(9, 7, 1, 0.25), band_mesh(10, 0), band_mesh(10, 2)}) {
    TriangleMesh mesh = good;
    const SurfaceReport report = accepted(mesh);
    EXPECT_THAT(report.repairs, IsEmpty());
    EXPECT_THAT(report.warnings, IsEmpty());
    EXPECT_EQ(report.bodies, 1u);
    EXPECT_EQ(mesh.triangles, good.triangles);
    EXPECT_EQ(mesh.positions, good.positions);
  }
}

TEST(SurfaceCheck, WeldsSeamsAndKeepsTexture) {
  TriangleMesh mesh = soup(box_mesh());
  mesh.positions.raw()[0].x = -0.0;  // the same place as 0
  Random random(3);
  for (std::size_t t = 0; t < 12; ++t) {
    std::array<Vec2f, 3> uv;
    for (Vec2f& c : uv) c = {static_cast<float>(random.uniform()), static_cast<float>(random.uniform())};
    mesh.texture.push_back(uv);
    mesh.group.push_back(static_cast<std::int32_t>(t % 3));
  }
  const TriangleMesh before = mesh;
  const SurfaceReport report = accepted(mesh, closed());
  EXPECT_THAT(report.repairs, ElementsAre("welded 28 vertices that lay at the same place as others"));
  EXPECT_EQ(mesh.positions.size(), 8u);
  EXPECT_EQ(mesh.texture, before.texture);
  EXPECT_EQ(mesh.group, before.group);
  for (std::size_t t = 0; t < 12; ++t) {
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(mesh.positions[mesh.triangles.raw()[t][i]], before.positions[before.triangles.raw()[t][i]]);
    }
  }
  EXPECT_DOUBLE_EQ(report.measures.volume, 1);
}

TEST(SurfaceCheck, WeldsWithinAToleranceWhenAsked) {
  Random random(5);
  TriangleMesh mesh = soup(torus_mesh(24, 12, 2, 0.5));
  for (Vec3& p : mesh.positions) {
    p += Vec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)}.x * Vec3{1e-8, -1e-8, 1e-8};
  }
  SurfaceRequirements exact = closed();
  exact.weld_tolerance = 0;
  EXPECT_THAT(refused(mesh, exact), AllOf(HasSubstr("the surface is open"), HasSubstr("weld tolerance")));
  SurfaceRequirements tolerant = closed();
  const SurfaceReport report = accepted(mesh, tolerant);
  EXPECT_EQ(mesh.positions.size(), 24u * 12u);
  EXPECT_EQ(report.measures.euler, 0);
  tolerant.weld_tolerance = std::nan("");
  EXPECT_THAT(refused(mesh, tolerant), HasSubstr("weld tolerance"));
}

TEST(SurfaceCheck, AClosedSurfaceWithCoincidingVerticesStaysApart) {
  // Two wedges that touch along a whole face as if cut, joined elsewhere: here simply a torus whose start and
  // end touch.
  TriangleMesh mesh = box_mesh();
  append(mesh, box_mesh({1, 0, 0}, {2, 1, 1}));  // touching boxes: welding would make a non-manifold
  SurfaceRequirements any = closed();
  any.single_body = false;
  const SurfaceReport report = accepted(mesh, any);
  EXPECT_EQ(report.bodies, 2u);
  EXPECT_EQ(mesh.positions.size(), 16u);
  EXPECT_THAT(report.warnings, ElementsAre("4 vertices lie at the same place as others and stayed apart"));
  EXPECT_THAT(refused(mesh), HasSubstr("2 separate bodies in one surface, of 12, 12 triangles"));
}

// Which vertices are one: the rule, by what it keeps and what it joins.

TEST(SurfaceCheck, ASlitOfAClosedBodyStaysASlit) {
  TriangleMesh plate = slit_plate(4);
  const TriangleMesh before = plate;
  SurfaceReport report = accepted(plate, closed());
  EXPECT_EQ(plate.triangles, before.triangles);
  EXPECT_THAT(report.repairs, IsEmpty());
  EXPECT_THAT(report.warnings, ElementsAre("8 vertices lie at the same place as others and stayed apart"));
  EXPECT_NEAR(report.measures.volume, 3.84e-5, 1e-15);
  EXPECT_EQ(report.measures.euler, 2);

  // Merged by place, as formats without indices are: what has material between it belongs together.
  for (const bool inside_out : {false, true}) {
    TriangleMesh loose = soup(slit_plate(4));
    if (inside_out) invert(loose);
    report = accepted(loose, closed());
    EXPECT_THAT(report.repairs,
                Contains("took 12 edges and 8 vertices apart where lips of a slit, or bodies, lie on each other"));
    EXPECT_EQ(loose.positions.size(), before.positions.size());
    EXPECT_NEAR(report.measures.volume, 3.84e-5, 1e-15);
    EXPECT_EQ(report.measures.euler, 2);
    EXPECT_EQ(report.bodies, 1u);
  }
  // Cut through.
  EXPECT_THAT(refused(slit_plate(8)), HasSubstr("2 separate bodies in one surface, of 248, 248 triangles"));
  EXPECT_THAT(refused(soup(slit_plate(8))), HasSubstr("2 separate bodies in one surface, of 248, 248 triangles"));
}

TEST(SurfaceCheck, ASheetKeepsItsCuts) {
  TriangleMesh sheet = slit_sheet(4);
  const TriangleMesh before = sheet;
  EXPECT_THAT(accepted(sheet).warnings, ElementsAre("4 vertices lie at the same place as others and stayed apart"));
  EXPECT_EQ(sheet.triangles, before.triangles);
  const TriangleMesh in_two = slit_sheet(8);
  EXPECT_THAT(
      refused(in_two),
      AllOf(
          HasSubstr("2 separate bodies in one surface, of 96, 96 triangles"),
          HasSubstr(
              "9 vertices lie at the same place as others: if those are seams, a weld distance joins them (--weld 1.4e-08)")));
  SurfaceRequirements joined;
  joined.weld = 1.4e-8;
  TriangleMesh mesh = in_two;
  EXPECT_THAT(accepted(mesh, joined).repairs, ElementsAre("welded 9 vertices that lay at the same place as others"));
  // Loose triangles keep nothing together, so a cut in them can't be told.
  mesh = soup(in_two);
  accepted(mesh);
  EXPECT_EQ(mesh.positions.size(), 13u * 9u);
}

TEST(SurfaceCheck, ASeamOfTheTextureIsNoCut) {
  for (const bool seam : {false, true}) {
    TriangleMesh sheet = slit_sheet(8);
    for (const auto& t : sheet.triangles) {
      std::array<Vec2f, 3> uv;
      const double middle = (sheet.positions[t[0]].x + sheet.positions[t[1]].x + sheet.positions[t[2]].x) / 3;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 p = sheet.positions[t[k]];
        uv[k] = {static_cast<float>(p.x + (seam && middle > 0.06 ? 0.5 : 0)), static_cast<float>(p.y)};
      }
      sheet.texture.push_back(uv);
    }
    if (seam)
      EXPECT_THAT(accepted(sheet).repairs, ElementsAre("welded 9 vertices that lay at the same place as others"));
    else EXPECT_THAT(refused(sheet), HasSubstr("2 separate bodies"));
  }
}

// A ring whose 100,000 spokes end in one place, each in a vertex of its own. 9 s where those are compared with each other.
TEST(SurfaceCheck, ManySeamsAtOnePlaceAreNotComparedWithEachOther) {
  constexpr int kSpokes = 100000;
  TriangleMesh mesh = grid_mesh(1, 1);
  for (Vec3& p : mesh.positions) p += Vec3{3, 0, 0};
  for (int i = 0; i < kSpokes; ++i)
    for (const double r : {1.0, 2.0}) {
      const double a = 2 * std::numbers::pi * i / kSpokes;
      mesh.positions.push_back({r * std::cos(a), r * std::sin(a), 0});
    }
  for (int i = 0; i < kSpokes; ++i) {
    const int in = 4 + 2 * i, next = 4 + 2 * ((i + 1) % kSpokes);
    const VertexId hub = mesh.positions.push_back({0, 0, 1});
    mesh.triangles.push_back(tri(in, in + 1, next + 1));
    mesh.triangles.push_back(tri(in, next + 1, next));
    mesh.triangles.push_back({VertexId(in), VertexId(next), hub});
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) mesh.texture.push_back({});
  EXPECT_THAT(refused(mesh), HasSubstr("2 separate bodies"));
}

/// A seam of the texture, and beside it a ribbon that ends on the sheet: there edges would have three triangles.
TEST(SurfaceCheck, ASeamIsMergedWhereMergingAllFails) {
  for (const int rows : {4, 8}) {
    for (const bool single : {false, true}) {
      SCOPED_TRACE(rows + (single ? 10 : 0));
      TriangleMesh sheet = slit_sheet(rows);
      const int a = 12 * 9 + 3, n = static_cast<int>(sheet.positions.size());
      for (const Vec3 p : {Vec3{0.11, 0.03, 0.02}, Vec3{0.11, 0.04, 0.02}, Vec3{0.10, 0.03, 0}, Vec3{0.10, 0.04, 0}})
        sheet.positions.push_back(p);
      for (const auto& t : {tri(a + 1, a, n), tri(a + 1, n, n + 1), tri(n + 1, n, n + 2), tri(n + 1, n + 2, n + 3)})
        sheet.triangles.push_back(t);
      for (const auto& t : sheet.triangles) {
        std::array<Vec2f, 3> uv;
        const double middle = (sheet.positions[t[0]].x + sheet.positions[t[1]].x + sheet.positions[t[2]].x) / 3;
        for (std::size_t k = 0; k < 3; ++k) {
          const Vec3 p = sheet.positions[t[k]];
          uv[k] = {static_cast<float>(p.x + (middle > 0.06 ? 0.5 : 0)), static_cast<float>(p.y)};
        }
        sheet.texture.push_back(uv);
      }
      SurfaceRequirements requirements;
      requirements.single_body = single;
      const SurfaceReport report = accepted(sheet, requirements);
      EXPECT_THAT(report.repairs, ElementsAre(fmt::format("welded {} vertices that lay at the same place as others",
                                                          rows == 4 ? 4 : 9)));
      EXPECT_THAT(report.warnings, ElementsAre("2 vertices lie at the same place as others and stayed apart"));
      EXPECT_EQ(report.bodies, 1u);
    }
  }
}

/// Lips are told by equal bits, so what lies at one place gets them.
TEST(SurfaceCheck, LipsThatMissEachOtherByRoundingLieAtOnePlace) {
  for (const bool closed_body : {false, true}) {
    SCOPED_TRACE(closed_body);
    TriangleMesh mesh = closed_body ? slit_plate(4) : slit_sheet(4);
    const auto twins = [&] {
      const auto first = first_at_place(mesh.positions.raw());
      std::size_t n = 0;
      for (std::size_t v = 0; v < first.size(); ++v) n += first[v] != static_cast<std::int32_t>(v) ? 1 : 0;
      return n;
    };
    const std::size_t before = twins();
    // One pair stays exact. Beside another an edge shorter than what lies at one place stays as long as it is.
    for (int j = 1; j < 4; ++j) mesh.positions[VertexId(13 * 9 + j)] += Vec3{1e-17 * j, 1e-12 * j, 1e-9};
    const VertexId sliver = divide_edge(mesh, VertexId(13 * 9 + 2), VertexId(13 * 9 + 3), 1e-7);
    const Vec3 place = mesh.positions[sliver];
    EXPECT_EQ(twins(), before - 3);
    const std::size_t triangles = mesh.triangles.size();
    const SurfaceReport report = accepted(mesh);
    EXPECT_THAT(report.repairs, IsEmpty());
    EXPECT_EQ(mesh.triangles.size(), triangles);
    EXPECT_GE(twins(), before - 1);
    EXPECT_EQ(mesh.positions.raw().back(), place);
  }
}

/// A distance that joins is looked for where no triangle collapses: a quarter of the mean edge is far more than the shortest of a graded mesh,
/// and all its vertices there are compared with each other. 9 s where that was the bound.
TEST(SurfaceCheck, AGradedSheetIsJudgedInNoTime) {
  TriangleMesh mesh = grid_mesh(220, 220);
  for (Vec3& p : mesh.positions) p = 1e-3 * p;
  append(mesh, grid_mesh(220, 220));
  for (std::size_t v = 221 * 221; v < mesh.positions.size(); ++v) mesh.positions.raw()[v] += Vec3{0.01, 0, 0};
  SurfaceRequirements any;
  any.single_body = false;
  const SurfaceReport report = accepted(mesh, any);
  EXPECT_EQ(report.bodies, 2u);
  EXPECT_THAT(report.warnings, IsEmpty());
}

TEST(SurfaceCheck, NoDistanceAboveTheMeanEdgeIsWelded) {
  SurfaceRequirements asked;
  asked.weld = 0.005;
  EXPECT_THAT(refused(grid_mesh(300, 300), asked), AllOf(HasSubstr("weld is 0.005 m, but the mean edge is 0.00379 m"),
                                                         HasSubstr("give a smaller distance")));
}

TEST(SurfaceCheck, TheDistanceToWeldIsSaid) {
  Random random(7);
  const TriangleMesh good = slit_plate(0);
  TriangleMesh mesh = soup(good);
  for (Vec3& p : mesh.positions) p += 1e-7 * Vec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
  EXPECT_THAT(
      refused(mesh),
      AllOf(
          HasSubstr("separate bodies"),
          HasSubstr(
              "corners that should be one lie up to 1.4e-06 m apart; a weld distance of that joins them (--weld 1.4e-06)")));
  SurfaceRequirements asked;
  asked.weld = 1.4e-6;
  EXPECT_TRUE(accepted(mesh, asked).measures.closed);
  EXPECT_EQ(mesh.positions.size(), good.positions.size());
  asked.weld = 0;  // none
  EXPECT_THAT(refused(soup(good), asked), HasSubstr("separate bodies"));
  for (const double wrong : {-1.0, 0.01, std::nan("")}) {
    asked.weld = wrong;
    EXPECT_THAT(refused(good, asked), HasSubstr("weld is"));
  }
}

TEST(SurfaceCheck, BodiesThatTouchAlongAnEdgeAreTwo) {
  TriangleMesh boxes = box_mesh();
  append(boxes, box_mesh({1, 1, 0}, {2, 2, 1}));
  EXPECT_THAT(refused(boxes), HasSubstr("2 separate bodies in one surface, of 12, 12 triangles"));
  TriangleMesh shared = soup(boxes);
  EXPECT_THAT(refused(shared), HasSubstr("2 separate bodies in one surface, of 12, 12 triangles"));
  SurfaceRequirements any = closed();
  any.single_body = false;
  const SurfaceReport report = accepted(shared, any);
  EXPECT_EQ(report.bodies, 2u);
  EXPECT_EQ(report.several,
            "2 separate bodies in one surface, of 12, 12 triangles; keep one, or give each a file of its own");
  EXPECT_DOUBLE_EQ(report.measures.volume, 2);
}

TEST(SurfaceCheck, DropsDuplicatesCollapsedAndUnused) {
  TriangleMesh mesh = box_mesh();
  mesh.positions.push_back({0.5, 0.5, 0.5});
  mesh.triangles.push_back(mesh.triangles.raw()[3]);
  mesh.triangles.push_back(tri(3, 1, 0));  // the second triangle, started elsewhere
  mesh.triangles.push_back(
      {mesh.triangles.raw()[7][0], mesh.triangles.raw()[7][2], mesh.triangles.raw()[7][1]});  // turned
  mesh.triangles.push_back(tri(2, 2, 5));
  const SurfaceReport report = accepted(mesh, closed());
  EXPECT_THAT(report.repairs, ElementsAre("dropped 1 triangle with corners at the same place",
                                          "dropped 3 duplicate triangles", "dropped 1 vertex that no triangle uses"));
  EXPECT_EQ(mesh.triangles, box_mesh().triangles);
}

TEST(SurfaceCheck, FlatTriangles) {
  // On a border: a sliver along the bottom of a grid, which can go.
  TriangleMesh mesh = grid_mesh(2, 2);
  mesh.positions.push_back({0.25, 0, 0});
  mesh.triangles.push_back(tri(0, 9, 1));
  const SurfaceReport report = accepted(mesh);
  EXPECT_THAT(report.repairs, ElementsAre("dropped 1 triangle without area", "dropped 1 vertex that no triangle uses"));
  EXPECT_EQ(mesh.triangles, grid_mesh(2, 2).triangles);

  // Inside: vertex 10 on the edge between triangles 1 and 2 of a grid, with a flat triangle on the side of
  // one only.
  TriangleMesh inside = grid_mesh(2, 2);  // triangles (0 1 4) and (0 4 3)
  inside.positions.push_back({0.25, 0.25, 0});
  inside.triangles.raw()[0] = tri(0, 1, 9);
  inside.triangles.push_back(tri(1, 4, 9));
  inside.triangles.push_back(tri(0, 9, 4));
  EXPECT_THAT(refused(inside),
              AllOf(HasSubstr("a triangle has no area"), HasSubstr("triangle 10 (vertex 1 at (0, 0, 0))")));

  TriangleMesh line;
  line.positions.raw() = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  line.triangles.raw() = {tri(0, 1, 2)};
  EXPECT_THAT(refused(line), HasSubstr("no triangle has an area"));
}

TEST(SurfaceCheck, NonManifoldEdges) {
  TriangleMesh mesh = grid_mesh(1, 1);  // 0 1 3, 0 3 2
  mesh.positions.push_back({0.5, 0.5, 1});
  mesh.triangles.push_back(tri(0, 3, 4));
  EXPECT_THAT(refused(mesh), AllOf(HasSubstr("1 edge has more than two triangles: 1-4 at (0, 0, 0) (3 triangles)")));

  TriangleMesh boxes = box_mesh();
  append(boxes, box_mesh({1, 0, 0}, {2, 1, 1}));
  append(boxes, grid_mesh(1, 1));
  EXPECT_THAT(refused(boxes), AllOf(HasSubstr("3 separate bodies"), Not(HasSubstr("weld"))))
      << "welded, boxes would share a face";
}

TEST(SurfaceCheck, Orientation) {
  Random random(9);
  for (const TriangleMesh& good : {box_mesh(), grid_mesh(6, 5), torus_mesh(9, 7, 2, 0.5), band_mesh(10, 2)}) {
    for (int round = 0; round < 5; ++round) {
      TriangleMesh mesh = good;
      mesh.texture.resize(mesh.triangles.size());
      std::size_t turned = 0;
      for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        for (std::size_t i = 0; i < 3; ++i)
          mesh.texture.raw()[t][i] = {static_cast<float>(mesh.triangles.raw()[t][i].value), 0};
        if (random.index(4) != 0) continue;
        ++turned;
        std::swap(mesh.triangles.raw()[t][1], mesh.triangles.raw()[t][2]);
        std::swap(mesh.texture.raw()[t][1], mesh.texture.raw()[t][2]);
      }
      const SurfaceReport report = accepted(mesh);
      if (turned > 0) {
        ASSERT_FALSE(report.repairs.empty());
        EXPECT_THAT(report.repairs[0], HasSubstr(fmt::format("turned {} triangle", turned)));
      }
      EXPECT_EQ(report.measures.unoriented_edges, 0u);
      for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {  // texture went along with the corners
        for (std::size_t i = 0; i < 3; ++i) {
          EXPECT_EQ(mesh.texture.raw()[t][i].x, static_cast<float>(mesh.triangles.raw()[t][i].value));
        }
      }
    }
  }
  EXPECT_THAT(refused(band_mesh(12, 1)), HasSubstr("one-sided, like a Moebius strip"));
  EXPECT_THAT(refused(band_mesh(12, 3)), HasSubstr("one-sided"));
  TriangleMesh shuffled = band_mesh(9, 1);
  for (std::size_t t = 0; t < shuffled.triangles.size(); t += 3)
    std::swap(shuffled.triangles.raw()[t][0], shuffled.triangles.raw()[t][1]);
  EXPECT_THAT(refused(shuffled), HasSubstr("one-sided"));
}

TEST(SurfaceCheck, InsideOut) {
  TriangleMesh mesh = torus_mesh(12, 8, 2, 0.5);
  const TriangleMesh good = mesh;
  invert(mesh);
  const SurfaceReport report = accepted(mesh, closed());
  EXPECT_THAT(report.repairs, ElementsAre("turned the whole surface, which was inside out"));
  EXPECT_GT(report.measures.volume, 0);
  EXPECT_EQ(mesh.triangles, good.triangles);
}

TEST(SurfaceCheck, ShellsAndSeveralBodies) {
  for (const bool outer_wrong : {false, true}) {
    for (const bool inner_wrong : {false, true}) {
      TriangleMesh shell = box_mesh({0, 0, 0}, {3, 3, 3});
      if (outer_wrong) invert(shell);
      TriangleMesh hollow = box_mesh({1, 1, 1}, {2, 2, 2});
      if (!inner_wrong) invert(hollow);
      append(shell, hollow);
      const SurfaceReport report = accepted(shell, closed());
      EXPECT_EQ(report.bodies, 1u);
      EXPECT_EQ(report.cavities, 1u);
      EXPECT_NEAR(report.measures.volume, 26, 1e-12);
      EXPECT_EQ(report.repairs.size(), (outer_wrong ? 1u : 0u) + (inner_wrong ? 1u : 0u));
    }
  }
  TriangleMesh cheese = box_mesh({0, 0, 0}, {3, 3, 3});
  Random random(4);
  for (int i = 0; i < 27; ++i) {
    const Vec3 low{i % 3 + 0.2, i / 3 % 3 + 0.2, i / 9 + 0.2};
    TriangleMesh hole = box_mesh(low, low + Vec3{0.5, 0.5, 0.5});
    if (random.index(2) == 0) invert(hole);
    append(cheese, hole);
  }
  const SurfaceReport holes = accepted(cheese, closed());
  EXPECT_EQ(holes.cavities, 27u);
  EXPECT_EQ(holes.bodies, 1u);
  EXPECT_NEAR(holes.measures.volume, 27 - 27 * 0.125, 1e-12);

  // A body inside a hollow is one more body; its box is inside, and that of a neighbour in a torus's hole
  // too.
  TriangleMesh nested = box_mesh({0, 0, 0}, {5, 5, 5});
  append(nested, box_mesh({1, 1, 1}, {4, 4, 4}));
  append(nested, box_mesh({2, 2, 2}, {3, 3, 3}));
  EXPECT_THAT(refused(nested), HasSubstr("2 separate bodies in one surface, of 12, 12 triangles"));
  SurfaceRequirements several = closed();
  several.single_body = false;
  const SurfaceReport report = accepted(nested, several);
  EXPECT_NEAR(report.measures.volume, 125 - 27 + 1, 1e-12);

  TriangleMesh ring = torus_mesh(24, 12, 2, 0.5);
  append(ring, box_mesh({-0.3, -0.3, -0.3}, {0.3, 0.3, 0.3}));
  EXPECT_THAT(refused(ring), HasSubstr("2 separate bodies in one surface, of 576, 12 triangles"));

  TriangleMesh sheets = grid_mesh(2, 2);
  TriangleMesh above = grid_mesh(1, 1);
  for (Vec3& p : above.positions) p.z = 1;
  append(sheets, above);
  EXPECT_THAT(refused(sheets), HasSubstr("2 separate bodies in one surface, of 8, 2 triangles"));
}

TEST(SurfaceCheck, OpenAndClosed) {
  TriangleMesh open = box_mesh();
  open.triangles.raw().erase(open.triangles.begin() + 11);  // (1 7 5) and (0 2 3) share no vertex
  open.triangles.raw().erase(open.triangles.begin());
  SurfaceRequirements requirements = closed();
  requirements.name = "steak.obj";
  EXPECT_THAT(refused(open, requirements),
              AllOf(HasSubstr("steak.obj: the surface is open, but a closed one is needed here: "),
                    HasSubstr("2 borders with 6 edges")));
  EXPECT_EQ(accepted(open).measures.border_edges, 6u);
  SurfaceRequirements sheet;
  sheet.closedness = Closedness::kOpen;
  EXPECT_THAT(refused(box_mesh(), sheet), HasSubstr("the surface is closed, but an open one"));
  TriangleMesh grid = grid_mesh(3, 3);
  accepted(grid, sheet);
}

TEST(SurfaceCheck, FlatClosedSurfaces) {
  // Two fans over one hexagon, with a centre each: closed, without volume.
  TriangleMesh pillow;
  for (int i = 0; i < 6; ++i)
    pillow.positions.push_back({std::cos(i * 1.0471975511965976), std::sin(i * 1.0471975511965976), 0});
  pillow.positions.push_back({0, 0, 0});
  pillow.positions.push_back({0, 0, 0});
  for (int i = 0; i < 6; ++i) {
    pillow.triangles.push_back(tri(6, i, (i + 1) % 6));
    pillow.triangles.push_back(tri(7, (i + 1) % 6, i));
  }
  EXPECT_THAT(refused(pillow), HasSubstr("encloses no volume"));
  pillow.positions.raw()[7].z = -0.1;
  EXPECT_NEAR(accepted(pillow, closed()).measures.volume, 0.1 * 1.5 * std::sqrt(3.0) / 3, 1e-15);
}

TEST(SurfaceCheck, BackToBack) {
  // Every triangle twice, once from each side: one side goes.
  TriangleMesh both = grid_mesh(3, 2);
  TriangleMesh back = both;
  invert(back);
  append(both, back);
  EXPECT_THAT(accepted(both).repairs,
              ElementsAre("welded 12 vertices that lay at the same place as others", "dropped 12 duplicate triangles"));
  EXPECT_EQ(both.triangles, grid_mesh(3, 2).triangles);

  // A fin: two triangles on each other that stand on a box's edge.
  TriangleMesh fin = box_mesh();
  fin.positions.push_back({0.5, -1, -1});
  fin.triangles.push_back(tri(0, 1, 8));
  fin.triangles.push_back(tri(1, 0, 8));
  EXPECT_THAT(refused(fin), HasSubstr("triangles 13 and 14 lie back to back, folded at edge 1-9"));
}

TEST(SurfaceCheck, TouchingInAPoint) {
  // Two tetrahedra's worth of cones over one apex: a bow tie of two triangles, and two boxes at a corner.
  TriangleMesh bow;
  bow.positions.raw() = {{0, 0, 0}, {1, 1, 0}, {1, -1, 0}, {-1, 1, 0}, {-1, -1, 0}};
  bow.triangles.raw() = {tri(0, 2, 1), tri(0, 3, 4)};
  EXPECT_THAT(refused(bow), HasSubstr("2 separate bodies"));
  SurfaceRequirements several;
  several.single_body = false;
  const SurfaceReport report = [&] {
    auto r = check_surface(bow, several);
    EXPECT_TRUE(r.ok());
    return r.ok() ? *r : SurfaceReport{};
  }();
  expect_sound(bow);
  EXPECT_THAT(report.repairs, ElementsAre("split 1 vertex where parts of the surface touch in a single point"));
  EXPECT_EQ(bow.positions.size(), 6u);

  // A box with two holes that meet in a corner; what comes out is accepted as it is the next time.
  TriangleMesh open = box_mesh();
  open.triangles.raw().erase(open.triangles.begin() + 4);
  open.triangles.raw().erase(open.triangles.begin());
  EXPECT_EQ(accepted(open).repairs.size(), 1u);
  EXPECT_EQ(open.positions.size(), 9u);
}

TEST(SurfaceCheck, BrokenElements) {
  EXPECT_THAT(refused(TriangleMesh{}), HasSubstr("no triangles"));
  TriangleMesh mesh = box_mesh();
  mesh.positions.raw()[6].y = std::nan("");
  EXPECT_THAT(refused(mesh), HasSubstr("vertex 7 has a coordinate that is not a finite number"));
  mesh = box_mesh();
  mesh.triangles.raw()[5][1] = VertexId(8);
  EXPECT_THAT(refused(mesh), HasSubstr("triangle 6 names vertex 9, but there are 8"));
  mesh.triangles.raw()[5][1] = VertexId{};
  EXPECT_THAT(refused(mesh), HasSubstr("triangle 6 names vertex 0"));
  mesh = box_mesh();
  mesh.texture.resize(3);
  EXPECT_THAT(refused(mesh), HasSubstr("not one for every triangle"));
}

TEST(SurfaceCheck, Scale) {
  const auto scaled = [](double s, Vec3 offset = {}) {
    TriangleMesh mesh = box_mesh();
    for (Vec3& p : mesh.positions) p = s * p + offset;
    return mesh;
  };
  EXPECT_THAT(refused(scaled(1e7)), HasSubstr("give `scale` (--scale) the factor"));
  EXPECT_THAT(refused(scaled(1e-7)), HasSubstr("give `scale`"));
  EXPECT_THAT(refused(scaled(1e-320)), HasSubstr("give `scale`"));
  EXPECT_THAT(refused(scaled(1e308)), HasSubstr("give `scale`"));
  EXPECT_THAT(refused(scaled(0)), HasSubstr("at one place"));
  EXPECT_THAT(refused(scaled(1, {1e8, 0, 0})), HasSubstr("move it to the origin"));
  EXPECT_THAT(refused(scaled(1, {-1e8, 0, 0})), HasSubstr("1e+08 m from the origin"));
  TriangleMesh millimetres = scaled(45);
  EXPECT_THAT(accepted(millimetres).warnings, ElementsAre(HasSubstr("give `scale` (--scale 0.001 for millimetres)")));
  TriangleMesh far = scaled(1, {0, 1e5, 0});
  EXPECT_THAT(accepted(far).warnings, ElementsAre(HasSubstr("moving it nearer")));
  TriangleMesh outlier = box_mesh();
  outlier.positions.push_back({1e300, 0, 0});  // unused: doesn't matter
  EXPECT_THAT(accepted(outlier).warnings, IsEmpty());
}

TEST(SurfaceCheck, RandomDamageIsRepairedOrRefused) {
  Random random(21);
  int good = 0;
  for (int round = 0; round < 400; ++round) {
    TriangleMesh mesh = round % 2 == 0 ? torus_mesh(7, 5, 2, 0.5) : grid_mesh(5, 4);
    const auto vertices = static_cast<int>(mesh.positions.size());
    for (int k = random.index(4); k >= 0; --k) {
      auto& t = mesh.triangles.raw()[static_cast<std::size_t>(random.index(static_cast<int>(mesh.triangles.size())))];
      switch (random.index(5)) {
        case 0: t[0] = VertexId(random.index(vertices)); break;
        case 1: std::swap(t[0], t[1]); break;
        case 2: mesh.triangles.push_back(t); break;
        case 3:
          t = mesh.triangles.raw().back();
          mesh.triangles.raw().pop_back();
          break;
        default: mesh.positions[t[0]] = mesh.positions[t[1]]; break;
      }
    }
    SurfaceRequirements requirements;
    requirements.single_body = round % 3 != 0;
    const auto report = check_surface(mesh, requirements);
    if (!report.ok()) {
      EXPECT_FALSE(report.error().message.empty());
      continue;
    }
    ++good;
    expect_sound(mesh);
    EXPECT_EQ(report->measures.unoriented_edges + report->measures.non_manifold_edges, 0u);
  }
  EXPECT_GT(good, 100);
  EXPECT_LT(good, 395);
}

TEST(SurfaceCheck, RealMeshes) {
  const std::string root = test::source_dir() + "/../shared/meshes/";
  if (!std::filesystem::exists(root)) GTEST_SKIP() << "the real meshes are not here: " << root;
  auto meniscus = read_mesh(root + "medial-meniscus.obj");
  ASSERT_TRUE(meniscus.ok());
  const SurfaceReport closed_report = accepted(*meniscus, closed());
  EXPECT_EQ(closed_report.measures.euler, 2);
  EXPECT_EQ(closed_report.measures.vertices, 1564u);
  EXPECT_THAT(closed_report.repairs, IsEmpty());
  auto collision = read_mesh(root + "medial-meniscus-collision.obj");
  ASSERT_TRUE(collision.ok());
  const SurfaceReport open_report = accepted(*collision);
  EXPECT_EQ(open_report.measures.border_edges, 48u);
  EXPECT_EQ(open_report.measures.border_loops, 1u);
  EXPECT_EQ(open_report.measures.euler, 1);
  auto tibia = read_mesh(root + "tibia-cartilage.obj");
  ASSERT_TRUE(tibia.ok());
  EXPECT_THAT(refused(*tibia), HasSubstr("2 separate bodies"));
  SurfaceRequirements several;
  several.single_body = false;
  EXPECT_EQ(accepted(*tibia, several).measures.border_edges, 300u);
}

}  // namespace
}  // namespace kerf::surface_check_test
