#include "kerf/mesh/needles.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "kerf/mesh/models.h"
#include "kerf/mesh/surface_check.h"
#include "kerf/mesh/surface_tolerances.h"

namespace kerf::needles_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<VertexId> needles(const TriangleMesh& mesh) {
  std::vector<std::int32_t> place(mesh.positions.size());
  for (std::size_t v = 0; v < place.size(); ++v) place[v] = static_cast<std::int32_t>(v);
  return find_needles(mesh, place);
}

/// A cone over a polygon, with its floor where it is closed.
TriangleMesh cone(int sides, double radius, double height, bool closed) {
  TriangleMesh mesh;
  mesh.positions.push_back({0, 0, height});
  mesh.positions.push_back({0, 0, 0});
  for (int i = 0; i < sides; ++i) {
    const double a = 2 * std::numbers::pi * i / sides;
    mesh.positions.push_back({radius * std::cos(a), radius * std::sin(a), 0});
  }
  for (int i = 0; i < sides; ++i) {
    const VertexId a(2 + i), b(2 + (i + 1) % sides);
    mesh.triangles.push_back({VertexId(0), a, b});
    if (closed) mesh.triangles.push_back({VertexId(1), b, a});
  }
  return mesh;
}

TEST(Needles, AreTipsUnderTheLeastAngle) {
  // The angles at a cone's tip come to about 2 pi times the sine of half its opening.
  for (const int sides : {3, 12, 400}) {
    const double sine = kNeedle / (2 * std::numbers::pi);
    EXPECT_THAT(needles(cone(sides, 0.5 * sine, 1, true)), ElementsAre(VertexId(0))) << sides;
    EXPECT_THAT(needles(cone(sides, 2.5 * sine, 1, true)), IsEmpty()) << sides;
    EXPECT_THAT(needles(cone(sides, 1, 0, true)), IsEmpty()) << "a flat fan of narrow triangles";
  }
}

TEST(Needles, ATipOfAnOpenLeafIsNone) {
  TriangleMesh leaf;
  for (const Vec3 p : {Vec3{0, 0, 0}, Vec3{1, -0.001, 0}, Vec3{1, 0.001, 0}}) leaf.positions.push_back(p);
  leaf.triangles.push_back({VertexId(0), VertexId(1), VertexId(2)});
  EXPECT_THAT(needles(leaf), IsEmpty());
  // An export of both sides writes each triangle twice.
  leaf.triangles.push_back({VertexId(0), VertexId(2), VertexId(1)});
  EXPECT_THAT(needles(leaf), IsEmpty());
}

TEST(Needles, OfSoundBodiesThereAreNone) {
  for (const char* name : {"steak", "meniscus", "closed-sheet", "tube", "holed-slab"})
    EXPECT_THAT(needles(make_model(name, {})->visual), IsEmpty()) << name;
}

/// However far they are, they are named; with shared corners, and with corners of each triangle's own.
TEST(Needles, StrayVerticesAreNamedWhateverTheyDoToTheSize) {
  const TriangleMesh sound = make_model("closed-sheet", {})->visual;
  for (const double away : {3e1, 1e3, 1e5}) {
    TriangleMesh mesh = sound;
    for (const int v : {70, 500}) mesh.positions[VertexId(v)] = away * Vec3{1, 0.3 * v / 70, -0.2};
    TriangleMesh soup;
    for (const auto& t : mesh.triangles) {
      std::array<VertexId, 3> corners;
      for (std::size_t i = 0; i < 3; ++i) corners[i] = soup.positions.push_back(mesh.positions[t[i]]);
      soup.triangles.push_back(corners);
    }
    for (TriangleMesh* surface : {&mesh, &soup}) {
      SurfaceRequirements wanted;
      wanted.bindable = true;
      wanted.weld_tolerance = kWeldTolerance;
      const auto checked = check_surface(*surface, wanted);
      ASSERT_FALSE(checked.ok()) << away;
      EXPECT_THAT(checked.error().message, HasSubstr("2 vertices stick out of the surface like needles, the first is"));
    }
    EXPECT_THAT(needles(mesh), ElementsAre(VertexId(70), VertexId(500)));
  }
}

}  // namespace
}  // namespace kerf::needles_test
