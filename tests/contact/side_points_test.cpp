#include "kerf/contact/side_points.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <set>
#include <vector>

#include "cutting/cut_body.h"
#include "kerf/base/random.h"
#include "kerf/cutting/topology_change.h"
#include "kerf/lattice/lattice_adapt.h"
#include "kerf/lattice/lattice_build.h"
#include "support/synthetic_complex.h"

namespace kerf::side_points_test {
namespace {

using namespace testing_support;

LatticeFrame frame_of(std::array<int, 3> cells, double thickness) {
  LatticeFrame frame;
  frame.origin = {0, 0, -thickness / 2};
  frame.cell = {1.0 / cells[0], 1.0 / cells[1], thickness / cells[2]};
  frame.count = {cells[0], cells[1], cells[2]};
  return frame;
}

struct Sheet {
  CutBody cut;
  HexMesh hex;
  Embedding embedding;
  ContactSurface surface;
  SidePoints sides;

  explicit Sheet(std::array<int, 3> cells) : cut(sheet_65_mesh(), options()) {
    hex = build_lattice(cut.body.collision, frame_of(cells, 0.1)).value();
    EXPECT_TRUE(embed_all(cut.body, hex, embedding).ok());
    surface = make_contact_surface(cut.body.collision);
    choose_side_points(hex, surface, sides);
    renew_side_points(hex, embedding, surface, sides);
  }
  static SyntheticOptions options() {
    SyntheticOptions o;
    o.subdivisions = 2;
    o.thickness = 0.1;
    return o;
  }
};

TEST(SidePoints, PiecesTileTheFace) {
  for (int n = 1; n <= 7; ++n) {
    double area = 0;
    for (int piece = 0; piece < n * n; ++piece) {
      const auto c = side_piece(n, piece);
      for (const auto& w : c) {
        EXPECT_NEAR(w[0] + w[1] + w[2], 1, 1e-15);
        EXPECT_GE(std::min({w[0], w[1], w[2]}), 0);
      }
      area += (c[1][1] - c[0][1]) * (c[2][2] - c[0][2]) - (c[1][2] - c[0][2]) * (c[2][1] - c[0][1]);
    }
    EXPECT_NEAR(area, 1, 1e-12) << n;
  }
}

TEST(SidePoints, CellsAsLargeAsTrianglesNeedNone) {
  EXPECT_FALSE(Sheet({4, 4, 1}).sides.any());
  EXPECT_TRUE(Sheet({16, 16, 1}).sides.of_body[0].between);
  EXPECT_FALSE(Sheet({16, 16, 1}).sides.of_body[0].across);
  EXPECT_TRUE(Sheet({4, 4, 2}).sides.of_body[0].across);
  EXPECT_FALSE(Sheet({4, 4, 2}).sides.of_body[0].between);
}

// Every cell at a side has a collision vertex or a point in it or on it, each of which lies where it is carried.
TEST(SidePoints, NoCellOfASideIsFree) {
  Sheet sheet({24, 24, 2});
  std::vector<NodeState> nodes;
  for (const NodeId n : ids<NodeId>(sheet.hex.node_count())) {
    const Vec3 x = sheet.hex.rest(n);
    nodes.push_back({{x.x, x.y, x.z, 0}, {x.x, x.y, x.z, 0}});
  }
  std::set<std::array<int, 3>> held;
  const auto hold = [&](Vec3 p) {
    for (const double dx : {-1e-6, 1e-6})
      for (const double dy : {-1e-6, 1e-6})
        held.insert({static_cast<int>(std::floor((p.x + dx) * 24)), static_cast<int>(std::floor((p.y + dy) * 24)),
                     p.z > 0 ? 1 : 0});
  };
  const ContactSurface& s = sheet.surface;
  for (const SidePoint& point : sheet.sides.points) {
    Vec3 rest;
    const auto v = s.vertices(point.face);
    for (std::size_t k = 0; k < 3; ++k) rest += point.weight[k] * (s.rest[v[k]] + point.lift * s.offset[v[k]]);
    EXPECT_LT(norm(place_of(sheet.hex, point.carrier, nodes).now - rest), 1e-12);
    if (point.piece < 0) hold(rest);
  }
  for (const CollisionVertex v : ids<CollisionVertex>(s.vertex_count()))
    for (const double side : {-1.0, 1.0}) {
      const EmbeddedPoint& corner = sheet.sides.corner[v][side > 0 ? 1 : 0];
      const Vec3 rest = s.rest[v] + side * s.offset[v];
      ASSERT_TRUE(corner.copy.valid());
      EXPECT_LT(norm(place_of(sheet.hex, corner, nodes).now - rest), 1e-12);
      EXPECT_EQ(sheet.hex.cell[corner.copy][2], side > 0 ? 1 : 0);
      hold(rest);
    }
  int free = 0;
  for (int x = 0; x < 24; ++x)
    for (int y = 0; y < 24; ++y)
      for (int z = 0; z < 2; ++z) free += held.count({x, y, z}) == 0 ? 1 : 0;
  EXPECT_LT(free, 24 * 24 * 2 / 20);
}

// Followed from cut to cut they are what they are from scratch.
TEST(SidePoints, FollowCuts) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    Random random(seed);
    Sheet sheet({16, 16, seed % 2 == 0 ? 2 : 1});
    LatticeScratch scratch;
    LatticeChange change;
    EmbeddingScratch embedding_scratch;
    std::vector<VisualVertex> moved;
    for (int k = 0; k < 4; ++k) {
      JournalMark mark;
      journal_mark(sheet.cut.body, mark);
      sheet.cut.cut(
          {{random.uniform(-0.1, 1.1), -0.1, 0}, {random.uniform(0, 1), 0.5, 0}, {random.uniform(-0.1, 1.1), 1.1, 0}},
          false);
      const auto changed = changed_triangles(sheet.cut.body, mark);
      update_contact_surface(sheet.cut.body.collision, changed, sheet.surface);
      change.clear();
      adapt_lattice(sheet.cut.body.collision, sheet.hex, changed, scratch, change);
      embed_triangles(sheet.cut.body, sheet.hex, changed, sheet.embedding, embedding_scratch, moved);
      embed_triangles(sheet.cut.body, sheet.hex, change.triangles, sheet.embedding, embedding_scratch, moved);
      renew_side_points(sheet.hex, sheet.embedding, sheet.surface, sheet.sides);
      SidePoints anew;
      anew.of_body = sheet.sides.of_body;
      renew_side_points(sheet.hex, sheet.embedding, sheet.surface, anew);
      ASSERT_EQ(anew.points.size(), sheet.sides.points.size());
      for (std::size_t i = 0; i < anew.points.size(); ++i) {
        const SidePoint &a = anew.points[i], &b = sheet.sides.points[i];
        ASSERT_EQ(a.face, b.face);
        ASSERT_EQ(a.number, b.number);
        ASSERT_EQ(a.weight, b.weight);
        ASSERT_EQ(a.carrier.copy, b.carrier.copy);
        ASSERT_EQ(a.carrier.local, b.carrier.local);
      }
      for (const CollisionVertex v : ids<CollisionVertex>(anew.corner.size()))
        for (std::size_t end = 0; end < 2; ++end) ASSERT_EQ(anew.corner[v][end].copy, sheet.sides.corner[v][end].copy);
    }
  }
}

}  // namespace
}  // namespace kerf::side_points_test
