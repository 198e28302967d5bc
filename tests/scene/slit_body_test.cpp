// Bodies with slits, bodies cut in two: what Kerf writes is bound again.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "kerf/binding/validate_binding.h"
#include "kerf/mesh/lips.h"
#include "kerf/mesh/surface_measures.h"
#include "kerf/scene/scene_body.h"
#include "support/slit_plate.h"

namespace kerf::slit_body_test {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

Result<SceneBodyLoaded> bound(const TriangleMesh& visual, std::optional<double> thickness,
                              const TriangleMesh* collision = nullptr, int triangles = 0) {
  SceneBody body;
  body.collision_triangles = triangles;
  body.visual = "plate";
  body.thickness = thickness;
  SurfacesInMemory given{visual, std::nullopt};
  if (collision != nullptr) {
    body.collision = "middle";
    given.collision = *collision;
  }
  return load_scene_body(body, {}, nullptr, std::move(given));
}

TriangleMesh visual_of(const CellComplex& c) {
  TriangleMesh mesh;
  for (const VisualVertex v : ids<VisualVertex>(c.visual.vertex_count())) mesh.positions.push_back(c.visual.rest[v]);
  for (const VisualTriangle f : ids<VisualTriangle>(c.visual.face_count())) {
    std::array<VertexId, 3> t;
    for (std::size_t k = 0; k < 3; ++k) t[k] = VertexId(c.visual.origin[VisualHalfEdge(3 * f.index() + k)].value);
    mesh.triangles.push_back(t);
  }
  return mesh;
}

double border_length(const CollisionMesh& c) {
  double sum = 0;
  for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(c.half_edge_count()))
    if (!c.twin[h].valid()) sum += norm(c.rest[c.to(h)] - c.rest[c.from(h)]);
  return sum;
}

TEST(SlitBody, APlateWithASlitGetsAMidSurfaceWithASlit) {
  const TriangleMesh middle = slit_sheet(4);
  for (const TriangleMesh* collision : {static_cast<const TriangleMesh*>(nullptr), &middle}) {
    const auto body = bound(slit_plate(4), {}, collision);
    ASSERT_TRUE(body.ok()) << body.error().message;
    const CellComplex& c = body->bound.complex;
    EXPECT_TRUE(validate_binding(c).ok());
    const SurfaceMeasures m = surface_measures(visual_of(c));
    EXPECT_TRUE(m.closed);
    EXPECT_EQ(m.components, 1u);
    EXPECT_EQ(m.euler, 2);
    EXPECT_NEAR(m.volume, 3.84e-5, 1e-12);
    EXPECT_NEAR(m.area, 2 * 0.0096 + 0.004 * (0.4 + 0.08), 1e-10);  // with both walls of the slit
    EXPECT_NEAR(border_length(c.collision), 0.4 + 0.08, 0.01);
    EXPECT_LT(body->bound.report.displacement.mean, 0.01);
    EXPECT_THAT(body->notes, Contains(HasSubstr("8 vertices lie at the same place as others and stayed apart")));
  }
}

TEST(SlitBody, ASheetKeepsItsSlit) {
  const auto body = bound(slit_sheet(4), 0.002);
  ASSERT_TRUE(body.ok()) << body.error().message;
  const CellComplex& c = body->bound.complex;
  EXPECT_TRUE(validate_binding(c).ok());
  EXPECT_EQ(c.collision.vertex_count(), 13u * 9u + 4u);
  EXPECT_NEAR(border_length(c.collision), 0.4 + 0.08, 1e-12);
  // The lips lie where they lay.
  for (const CollisionVertex v : ids<CollisionVertex>(c.collision.vertex_count()))
    EXPECT_NEAR(100 * c.collision.rest[v].x, std::round(100 * c.collision.rest[v].x), 1e-12);
}

std::size_t twins(const TriangleMesh& mesh) {
  const auto first = first_at_place(mesh.positions.raw());
  std::size_t n = 0;
  for (std::size_t v = 0; v < first.size(); ++v) n += first[v] != static_cast<std::int32_t>(v) ? 1 : 0;
  return n;
}

/// Not at places where what lips are drawn back by can be added and taken away without rounding.
TriangleMesh shifted(TriangleMesh mesh) {
  for (Vec3& p : mesh.positions) p += Vec3{1e-5, 3e-5, 0};
  return mesh;
}

/// Lips are told by equal bits, and vertices that binding adds to one of them lie on edges or walls of the other.
TEST(SlitBody, WhatWasBoundIsBoundAgain) {
  TriangleMesh mesh = shifted(slit_plate(4));
  const TriangleMesh middle = shifted(slit_sheet(4));
  for (const TriangleMesh* collision : {&middle, static_cast<const TriangleMesh*>(nullptr)}) {
    SCOPED_TRACE(collision == nullptr);
    const auto first = first_at_place(mesh.positions.raw());
    EXPECT_GE(twins(mesh), 8u);
    const auto body = bound(mesh, {}, collision);
    ASSERT_TRUE(body.ok()) << body.error().message;
    const CellComplex& c = body->bound.complex;
    EXPECT_TRUE(validate_binding(c).ok());
    EXPECT_LT(body->bound.report.displacement.mean, 0.01);
    EXPECT_NEAR(border_length(c.collision), 0.4 + 0.08, 0.01);
    mesh = visual_of(c);
    for (std::size_t v = 0; v < first.size(); ++v)
      EXPECT_EQ(mesh.positions.raw()[v], mesh.positions.raw()[static_cast<std::size_t>(first[v])]) << v;
    const SurfaceMeasures m = surface_measures(mesh);
    EXPECT_TRUE(m.closed);
    EXPECT_EQ(m.euler, 2);
    EXPECT_NEAR(m.volume, 3.84e-5, 1e-12);
    EXPECT_NEAR(m.area, 2 * 0.0096 + 0.004 * (0.4 + 0.08), 1e-10);
  }
}

/// What is added to a coordinate and taken away again leaves other bits, often where it is larger than the coordinate.
TEST(SlitBody, LipsKeepTheirBits) {
  for (int i = 0; i < 20; ++i) {
    TriangleMesh sheet = slit_sheet(4);
    for (Vec3& p : sheet.positions) p = {p.x - 0.06 + 1.3e-5 * i, p.y + 1.7e-5 * i, 0};  // the slit is near x = 0
    const auto body = bound(sheet, 0.002);
    ASSERT_TRUE(body.ok()) << body.error().message;
    const CellComplex& c = body->bound.complex;
    for (std::size_t v = 0; v < sheet.positions.size(); ++v) {
      EXPECT_EQ(c.visual.rest[VisualVertex(v)], sheet.positions.raw()[v]) << i << ' ' << v;
      EXPECT_EQ(c.collision.rest[CollisionVertex(v)], sheet.positions.raw()[v]) << i << ' ' << v;
    }
  }
}

TEST(SlitBody, ASheetThatWasBoundIsBoundAgain) {
  TriangleMesh mesh = shifted(slit_sheet(4));
  for (const double power : {1.3, 0.8}) {  // collision vertices elsewhere along the slit
    SCOPED_TRACE(power);
    TriangleMesh collision = slit_sheet(4);
    for (Vec3& p : collision.positions)
      if (p.y < 0.04) p.y = 0.04 * std::pow(p.y / 0.04, power);
    collision = shifted(collision);
    const std::size_t before = mesh.positions.size();
    const auto body = bound(mesh, 0.002, &collision);
    ASSERT_TRUE(body.ok()) << body.error().message;
    const CellComplex& c = body->bound.complex;
    EXPECT_TRUE(validate_binding(c).ok());
    EXPECT_NEAR(border_length(c.collision), 0.4 + 0.08, 1e-12);
    mesh = visual_of(c);
    EXPECT_GT(mesh.positions.size(), before);
    EXPECT_GE(twins(mesh), 4u);
    const SurfaceMeasures m = surface_measures(mesh);
    EXPECT_EQ(m.euler, 1);
    EXPECT_NEAR(m.area, 0.0096, 1e-12);
    // Each lip is bound by its own: what is bound lies at one place with its collision vertex.
    for (const CollisionVertex v : ids<CollisionVertex>(c.collision.vertex_count())) {
      const Vec3 drawn = c.visual.rest[c.collision.bound[v][0]];
      EXPECT_LT(norm(drawn - c.collision.rest[v]), 1e-3 * 0.01) << v.value;
    }
  }
}

TEST(SlitBody, WhatIsCutInTwoStaysInTwo) {
  EXPECT_THAT(bound(slit_plate(8), {}).error().message,
              HasSubstr("2 separate bodies in one surface, of 248, 248 triangles"));
  EXPECT_THAT(bound(slit_sheet(8), 0.002).error().message,
              AllOf(HasSubstr("2 separate bodies in one surface, of 96, 96 triangles"), HasSubstr("--weld")));
}

TEST(SlitBody, AClosedBodyWithAHoleIsNoSheetWithoutAWord) {
  TriangleMesh plate = slit_plate(0);
  plate.triangles.raw().pop_back();
  EXPECT_THAT(bound(plate, {}).error().message, HasSubstr("is an open surface (3 of "));
  const auto body = bound(plate, 0.002);
  ASSERT_TRUE(body.ok()) << body.error().message;
  EXPECT_THAT(body->notes, Contains(AllOf(HasSubstr("only 3 of "), HasSubstr("it is taken as a sheet"))));
  const auto sheet = bound(slit_sheet(0), 0.002);
  ASSERT_TRUE(sheet.ok()) << sheet.error().message;
  EXPECT_TRUE(sheet->notes.empty());
}

/// Bumps so steep that the sheet lies back on itself: 10 s, and vertices of a mesh that nobody has seen.
TEST(SlitBody, FoldsOfASheetAreNamedWhereTheyAre) {
  constexpr int kSide = 40;
  TriangleMesh sheet;
  for (int i = 0; i <= kSide; ++i)
    for (int j = 0; j <= kSide; ++j) sheet.positions.push_back({0.001 * i, 0.001 * j, i == kSide / 2 ? 0.02 : 0});
  for (int i = 0; i < kSide; ++i)
    for (int j = 0; j < kSide; ++j) {
      const int a = i * (kSide + 1) + j;
      sheet.triangles.push_back({VertexId(a), VertexId(a + kSide + 1), VertexId(a + kSide + 2)});
      sheet.triangles.push_back({VertexId(a), VertexId(a + kSide + 2), VertexId(a + 1)});
    }
  EXPECT_THAT(bound(sheet, 0.0005).error().message,
              AllOf(HasSubstr("the sheet is folded back on itself, by 174 degrees at (0.02, "),
                    HasSubstr("at 40 of its edges"), HasSubstr("134 degrees are the most")));
}

}  // namespace
}  // namespace kerf::slit_body_test
