#include "kerf/mesh/lips.h"

#include <gtest/gtest.h>

#include "kerf/mesh/surface_measures.h"
#include "support/slit_plate.h"

namespace kerf::lips_test {
namespace {

Vec3 normal_of(const TriangleMesh& mesh, TriangleId t) {
  const auto at = [&](std::size_t k) { return mesh.positions[mesh.triangles[t][k]]; };
  return cross(at(1) - at(0), at(2) - at(0));
}

TEST(Lips, AMeshWithoutAnyStays) {
  const TriangleMesh sheet = slit_sheet(0);
  EXPECT_TRUE(draw_lips_back(sheet).empty());
  EXPECT_EQ(with_lips_drawn_back(sheet).positions, sheet.positions);
}

TEST(Lips, GoBackIntoTheirOwnMaterial) {
  for (const bool closed : {false, true}) {
    const TriangleMesh mesh = closed ? slit_plate(4) : slit_sheet(4);
    const std::vector<Vec3> back = draw_lips_back(mesh);
    ASSERT_EQ(back.size(), mesh.positions.size());
    const auto first = first_at_place(mesh.positions.raw());
    int lips = 0, moved = 0;
    for (std::size_t v = 0; v < back.size(); ++v) {
      moved += norm(back[v]) > 0 ? 1 : 0;
      if (first[v] == static_cast<std::int32_t>(v)) continue;
      ++lips;
      const auto u = static_cast<std::size_t>(first[v]);
      EXPECT_GT(norm(back[v]), 1e-5);
      EXPECT_LT(back[u].x, 0);  // the lip of the squares before the slit
      EXPECT_GT(back[v].x, 0);
    }
    EXPECT_EQ(lips, closed ? 8 : 4);
    EXPECT_EQ(moved, 2 * lips) << "the tip stays, and what is farther off";
    const TriangleMesh apart = with_lips_drawn_back(mesh);
    for (const TriangleId t : ids<TriangleId>(mesh.triangles.size()))
      EXPECT_GT(dot(normal_of(mesh, t), normal_of(apart, t)), 0);
    EXPECT_EQ(surface_measures(apart).euler, surface_measures(mesh).euler);
  }
}

/// Triangles far smaller than the gap next to a lip.
TEST(Lips, WhatLiesBehindThemFollows) {
  TriangleMesh mesh = slit_sheet(4);
  for (Vec3& p : mesh.positions)
    if (std::fabs(p.x - 0.06) > 0.001 && std::fabs(p.x - 0.06) < 0.011) p.x = 0.06 + 1e-3 * (p.x - 0.06);
  const TriangleMesh apart = with_lips_drawn_back(mesh);
  for (const TriangleId t : ids<TriangleId>(mesh.triangles.size()))
    EXPECT_GT(dot(normal_of(mesh, t), normal_of(apart, t)), 0) << t.value;
}

/// Binding divides each lip where its own paths end: edges and walls of one lip have vertices that the other has not.
TEST(Lips, VerticesThatTheOtherLipHasNotGoBackToo) {
  for (const bool closed : {false, true}) {
    SCOPED_TRACE(closed);
    TriangleMesh mesh = closed ? slit_plate(4) : slit_sheet(4);
    constexpr int kTip = 6 * 9 + 4, kLip = 13 * 9, kOther = 6 * 9, kBelow = 13 * 9 + 4;
    std::vector<VertexId> after, before;  // the slit
    after.push_back(divide_edge(mesh, VertexId(kLip + 1), VertexId(kLip + 2), 0.3));
    after.push_back(divide_edge(mesh, VertexId(kLip + 3), VertexId(kTip), 0.4));
    before.push_back(divide_edge(mesh, VertexId(kOther + 1), VertexId(kOther + 2), 0.6));
    before.push_back(divide_edge(mesh, VertexId(kOther + 3), VertexId(kTip), 0.7));
    if (closed) {  // inside a wall, and the tip's own edge
      after.push_back(divide_edge(mesh, VertexId(kLip + 2), VertexId(kLip + 2 + kBelow), 0.2));
      divide_edge(mesh, VertexId(kTip), VertexId(kTip + kBelow), 0.3);
    }
    const std::vector<Vec3> back = draw_lips_back(mesh);
    ASSERT_EQ(back.size(), mesh.positions.size());
    for (const VertexId v : after) EXPECT_GT(back[v.index()].x, 1e-5) << v.value;
    for (const VertexId v : before) EXPECT_LT(back[v.index()].x, -1e-5) << v.value;
    const TriangleMesh apart = with_lips_drawn_back(mesh);
    for (const TriangleId t : ids<TriangleId>(mesh.triangles.size()))
      EXPECT_GT(dot(normal_of(mesh, t), normal_of(apart, t)), 0) << t.value;
  }
}

TEST(Lips, PlacesAreTold) {
  const std::vector<Vec3> positions = {{1, 0, 0}, {0.0, 1, 0}, {1, 0, 0}, {-0.0, 1, 0}};
  EXPECT_EQ(first_at_place(positions), (std::vector<std::int32_t>{0, 1, 0, 1}));
}

}  // namespace
}  // namespace kerf::lips_test
