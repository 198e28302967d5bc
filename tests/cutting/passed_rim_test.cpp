#include "kerf/cutting/passed_rim.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "kerf/binding/collision_mesh_build.h"

namespace kerf::passed_rim_test {
namespace {

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
  [[nodiscard]] CollisionHalfEdge passed(Vec3 tip, Vec3 along) {
    position[0] = tip;
    return passed_rim(mesh, position, CollisionVertex(0), along);
  }
  CollisionMesh mesh;
  std::vector<Vec3> position;
};

TEST(PassedRim, IsTheOneThatTheTipIsBeyond) {
  Hexagon h;
  const double rim = std::sqrt(3.0) / 2;
  for (const Vec3 along : {Vec3{0, 0, 1}, Vec3{0, 0, -1}, Vec3{0.3, -0.2, 0.9}}) {
    EXPECT_FALSE(h.passed({0, 0, 0}, along).valid());
    EXPECT_FALSE(h.passed({0.2, rim - 1e-6, 0}, along).valid()) << "just before it";
    const CollisionHalfEdge passed = h.passed({0.2, rim + 1e-6, 0}, along);
    ASSERT_TRUE(passed.valid());
    EXPECT_TRUE(h.mesh.is_border(passed));
    EXPECT_EQ(h.mesh.from(passed), CollisionVertex(1));
    EXPECT_EQ(h.mesh.to(passed), CollisionVertex(2));
    EXPECT_FALSE(h.passed({0, -1.2, 0}, along).valid()) << "across a side that is none";
  }
}

}  // namespace
}  // namespace kerf::passed_rim_test
