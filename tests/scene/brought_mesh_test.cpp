// Meshes as people bring them: kerf info says what kerf bind does.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kerf/base/random.h"
#include "kerf/mesh/mesh_file.h"
#include "kerf/mesh/surface_check.h"
#include "kerf/scene/scene_body.h"
#include "support/slit_plate.h"

namespace kerf::brought_mesh_test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// What kerf info asks.
Result<SurfaceReport> told(TriangleMesh mesh) {
  SurfaceRequirements requirements;
  requirements.bindable = true;
  requirements.single_body = false;
  return check_surface(mesh, requirements);
}

Result<SceneBodyLoaded> bound(const TriangleMesh& mesh, std::optional<double> thickness = {},
                              std::optional<double> weld = {}) {
  SceneBody body;
  body.visual = "mesh";
  body.thickness = thickness;
  body.weld = weld;
  return load_scene_body(body, {}, nullptr, {mesh, std::nullopt});
}

/// Every triangle with corners of its own that miss their place by up to so many metres, as STL files have them.
TriangleMesh loose(const TriangleMesh& mesh, double by) {
  Random random(5);
  TriangleMesh out;
  for (const auto& t : mesh.triangles) {
    std::array<VertexId, 3> corners;
    for (std::size_t k = 0; k < 3; ++k)
      corners[k] = out.positions.push_back(
          mesh.positions[t[k]] + by * Vec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)});
    out.triangles.push_back(corners);
  }
  return out;
}

TEST(BroughtMesh, HolesThatTouchInAPointAreSplit) {
  TriangleMesh sheet = slit_sheet(0);
  std::vector<std::array<VertexId, 3>> kept;
  for (const auto& t : sheet.triangles) {
    Vec3 middle;
    for (const VertexId v : t) middle += (1.0 / 3) * sheet.positions[v];
    const auto in = [&](double x, double y) {
      return middle.x > x && middle.x < x + 0.01 && middle.y > y && middle.y < y + 0.01;
    };
    if (!in(0.03, 0.03) && !in(0.04, 0.04)) kept.push_back(t);
  }
  ASSERT_EQ(kept.size(), sheet.triangles.size() - 4);
  sheet.triangles.raw() = kept;
  const auto report = told(sheet);
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_THAT(report->repairs, ElementsAre("split 1 vertex where parts of the surface touch in a single point"));
  EXPECT_EQ(report->measures.border_loops, 2u);
  const auto body = bound(sheet, 0.001);
  ASSERT_TRUE(body.ok()) << body.error().message;
  EXPECT_THAT(body->notes, ElementsAre("mesh: " + report->repairs[0]));
}

TEST(BroughtMesh, CornersThatNearlyMeetAreOne) {
  const TriangleMesh mesh = loose(slit_plate(0), 1e-9);
  const auto report = told(mesh);
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_TRUE(report->measures.closed);
  EXPECT_EQ(report->measures.components, 1u);
  EXPECT_NEAR(report->measures.volume, 3.84e-5, 1e-10);
  const auto body = bound(mesh);
  EXPECT_TRUE(body.ok()) << body.error().message;
}

TEST(BroughtMesh, CornersThatMissEachOtherAreToldAndWelded) {
  const TriangleMesh mesh = loose(slit_plate(0), 1e-7);
  const auto way = HasSubstr("a weld distance of that joins them (--weld 1.4e-06)");
  const auto report = told(mesh);
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_THAT(report->warnings, ElementsAre(way));
  EXPECT_THAT(bound(mesh).error().message, AllOf(HasSubstr("separate bodies"), way));
  const auto body = bound(mesh, {}, 1.4e-6);
  EXPECT_TRUE(body.ok()) << body.error().message;
}

TEST(BroughtMesh, AFinIsNamedByItsEdge) {
  TriangleMesh mesh = slit_plate(0);
  mesh.triangles.push_back({VertexId(0), VertexId(9), mesh.positions.push_back({0.005, 0.005, 0.02})});
  for (const TriangleMesh& fin : {mesh, loose(mesh, 0)}) {
    const auto edge = AllOf(HasSubstr("1 edge has more than two triangles"), HasSubstr("(3 triangles)"));
    const auto report = told(fin);
    ASSERT_FALSE(report.ok());
    EXPECT_THAT(report.error().message, edge);
    EXPECT_THAT(bound(fin).error().message, edge);
  }
}

TEST(BroughtMesh, PlatesThatShareAnEdgeAreTwo) {
  TriangleMesh mesh = slit_plate(0);
  const TriangleMesh other = mesh;
  const auto n = static_cast<int>(mesh.positions.size());
  for (const Vec3 p : other.positions) mesh.positions.push_back(p + Vec3{0.12, 0, 0.004});
  for (const auto& t : other.triangles)
    mesh.triangles.push_back({VertexId(t[0].value + n), VertexId(t[1].value + n), VertexId(t[2].value + n)});
  for (const TriangleMesh& two : {mesh, loose(mesh, 0)}) {
    const auto report = told(two);
    ASSERT_TRUE(report.ok()) << report.error().message;
    EXPECT_EQ(report->bodies, 2u);
    EXPECT_THAT(bound(two).error().message, HasSubstr(report->several));
  }
}

/// ModelNet's header; faces over several lines; corners with texture numbers without a list of texture coordinates.
TEST(BroughtMesh, DialectsGiveTheSamePlate) {
  const TriangleMesh plate = slit_plate(0);
  std::string vertices, obj, faces, broken;
  for (const Vec3 p : plate.positions) {
    vertices += fmt::format("{} {} {}\n", p.x, p.y, p.z);
    obj += fmt::format("v {} {} {}\n", p.x, p.y, p.z);
  }
  for (const auto& t : plate.triangles) {
    faces += fmt::format("3 {} {} {}\n", t[0].value, t[1].value, t[2].value);
    broken += fmt::format("3 {}\n{} {}\n", t[0].value, t[1].value, t[2].value);
    obj += fmt::format("f {0}/{0} {1}/{1} {2}/{2}\n", t[0].value + 1, t[1].value + 1, t[2].value + 1);
  }
  const std::string counts = fmt::format("{} {} 0\n", plate.positions.size(), plate.triangles.size());
  for (const auto& read : {parse_off("OFF" + counts + vertices + faces, "x.off"),
                           parse_off("OFF\n" + counts + vertices + broken, "x.off"), parse_obj(obj, "x.obj")}) {
    ASSERT_TRUE(read.ok()) << read.error().message;
    const auto report = told(*read);
    ASSERT_TRUE(report.ok()) << report.error().message;
    EXPECT_THAT(report->repairs, IsEmpty());
    EXPECT_TRUE(report->measures.closed);
    EXPECT_EQ(report->measures.vertices, plate.positions.size());
    EXPECT_EQ(report->measures.triangles, plate.triangles.size());
    EXPECT_NEAR(report->measures.volume, 3.84e-5, 1e-12);
  }
}

}  // namespace
}  // namespace kerf::brought_mesh_test
