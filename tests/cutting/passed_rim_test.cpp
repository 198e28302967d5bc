#include "kerf/cutting/passed_rim.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "cutting/cut_body.h"
#include "kerf/binding/collision_mesh_build.h"

namespace kerf::passed_rim_test {
namespace {

using testing_support::CutBody;

/// A hexagon about a tip. The side between 1 and 2 is a rim; a ring of faces goes on beyond the others.
///
///       2 ----- 1
///      /  \   /  \          0: the tip
///     3 --- 0 --- 6
///      \  /   \  /
///       4 ----- 5
struct Hexagon {
  Hexagon() {
    TriangleMesh surface;
    surface.positions.push_back({0, 0, 0});
    for (int k = 1; k <= 6; ++k) surface.positions.push_back({std::cos(k * M_PI / 3), std::sin(k * M_PI / 3), 0});
    for (int k = 1; k <= 6; ++k) surface.triangles.push_back({VertexId(0), VertexId(k), VertexId(k % 6 + 1)});
    // A ring around all sides but the one between 1 and 2.
    for (int k = 1; k <= 6; ++k)
      surface.positions.push_back({2 * std::cos(k * M_PI / 3), 2 * std::sin(k * M_PI / 3), 0});
    for (int k = 2; k <= 6; ++k) {
      const VertexId a(k), b(k % 6 + 1), c(6 + k), d(6 + k % 6 + 1);
      surface.triangles.push_back({a, c, d});
      surface.triangles.push_back({a, d, b});
    }
    mesh = build_collision_mesh(surface, std::vector<double>(surface.positions.size(), 0.05)).value();
    for (const CollisionVertex v : ids<CollisionVertex>(mesh.vertex_count())) position.push_back(mesh.rest[v]);
  }
  /// For an upright edge that has come to a place, with its motion along y.
  [[nodiscard]] CollisionHalfEdge passed(Vec3 to, double least = 0) const {
    return passed_rim(mesh, position, CollisionVertex(0),
                      {{to + Vec3{0, 0, -1}, to + Vec3{0, 0, 1}}, {0, 1, 0}, least, 0})
        .rim;
  }
  CollisionMesh mesh;
  std::vector<Vec3> position;
};

constexpr double kRim = 0.8660254037844386;  // m, y of the rim

TEST(PassedRim, IsTheOneBehindTheEdge) {
  const Hexagon h;
  EXPECT_FALSE(h.passed({0.2, kRim - 1e-6, 0}).valid()) << "just before it";
  const CollisionHalfEdge passed = h.passed({0.2, kRim + 1e-6, 0});
  ASSERT_TRUE(passed.valid());
  EXPECT_TRUE(h.mesh.is_border(passed));
  EXPECT_EQ(h.mesh.from(passed), CollisionVertex(1));
  EXPECT_EQ(h.mesh.to(passed), CollisionVertex(2));
  EXPECT_FALSE(h.passed({0.2, kRim + 1e-6, 0}, 2e-6).valid()) << "not by so much";
  EXPECT_FALSE(h.passed({0.51, kRim + 0.1, 0}).valid()) << "beside it";
  EXPECT_FALSE(h.passed({0.2, kRim + 0.1, 1.1}).valid()) << "above it";
  EXPECT_FALSE(h.passed({0.2, -kRim + 0.1, 0}).valid()) << "a side that is no rim is behind the edge";
}

TEST(PassedRim, IsSeenInAStrandThatHasRolledOnItsSide) {
  Hexagon h;
  for (Vec3& x : h.position) x = {x.x, 0.01 * x.y, x.y};  // it stands along the edge
  EXPECT_FALSE(h.passed({0.2, 0.01 * kRim - 1e-6, 0.5}).valid());
  EXPECT_TRUE(h.passed({0.2, 0.01 * kRim + 1e-6, 0.5}).valid());
}

// The plane of a blade that is beside the path goes through the rim beside the mouth, behind the edge.
TEST(PassedRim, IsNotTheOneThatThePathCameInThrough) {
  CutBody sheet = CutBody::sheet(2, true);
  sheet.cut({{0.44, -0.1, 0}, {0.44, 0.1, 0}, {0.47, 0.105, 0}});
  const CollisionMesh& mesh = sheet.body.collision;
  const Vec3 end{0.47, 0.105, 0};
  std::vector<Vec3> position;
  CollisionVertex tip;
  for (const CollisionVertex v : ids<CollisionVertex>(mesh.vertex_count())) {
    position.push_back(mesh.rest[v]);
    if (mesh.on_border(v) && (!tip.valid() || norm(mesh.rest[v] - end) < norm(mesh.rest[tip] - end))) tip = v;
  }
  ASSERT_TRUE(tip.valid());
  for (const double x : {0.38, 0.42, 0.45, 0.46, 0.47}) {
    const PassingEdge edge{{{x, 0.13, -1}, {x, 0.13, 1}}, {0, 1, 0}, 0, 0.1};
    EXPECT_FALSE(passed_rim(mesh, position, tip, edge).exists()) << x;
  }
}

}  // namespace
}  // namespace kerf::passed_rim_test
