// Paths opened along stops, one rule at a time, on one square in four faces.
#include "kerf/cutting/path_opening.h"

#include "cutting/four_faces.h"

namespace kerf::path_opening_test {
namespace {

using namespace testing_support;
using Stop = CutStop;

struct Bench : FourFaces {
  explicit Bench(bool closed)
      : FourFaces(closed), context{body, options, scratch}, opening({context, position, boxes}, feature, 1e-9) {}

  bool open(const std::vector<Stop>& stops, bool loop = false) {
    const bool done = opening.open(stops, {}, loop);
    expect_valid();
    EXPECT_EQ(position.size(), body.collision.vertex_count());
    for (std::size_t i = 0; i < position.size(); ++i)
      EXPECT_LT(norm(position[i] - place(CollisionVertex(i))), 1e-12) << i;
    return done;
  }
  Stop inside(double x, double y) const { return Stop::inside(point(x, y)); }
  static Stop vertex(int v) { return Stop::at_vertex(CollisionVertex(v)); }
  static Stop on_edge(int a, int b, double fraction) {
    return Stop::on_edge(CollisionVertex(a), CollisionVertex(b), fraction);
  }
  Vec3 last() const { return place(opening.made().back()); }

  cut::CutContext context;
  PathOpening opening;
};

class PathOpens : public ::testing::TestWithParam<bool> {};

TEST_P(PathOpens, ToAPointInsideAndNoFarther) {
  Bench b(GetParam());
  ASSERT_TRUE(b.open({b.on_edge(0, 1, 0.4), b.inside(0.5, 0.2)}));
  EXPECT_EQ(b.opening.made().size(), 2u);
  EXPECT_LT(norm(b.place(b.opening.made()[0]) - Vec3{0.4, 0, 0}), 1e-12);
  EXPECT_LT(norm(b.last() - Vec3{0.5, 0.2, 0}), 1e-12);
  EXPECT_EQ(b.opening.opened(), 1);
  EXPECT_EQ(b.pieces(), 1);
}

// The edge is divided by the first stop; the last lies on what is left of it.
TEST_P(PathOpens, OutOverTheEdgeThatItBeganOn) {
  for (const double first : {0.3, 0.7}) {
    Bench b(GetParam());
    ASSERT_TRUE(b.open({b.on_edge(0, 1, first), b.inside(0.5, 0.1), b.on_edge(0, 1, 1 - first)}));
    EXPECT_LT(norm(b.last() - Vec3{1 - first, 0, 0}), 1e-12);
    EXPECT_EQ(b.opening.opened(), 2);
    EXPECT_EQ(b.pieces(), 2);
  }
}

// A wedge along the edge, of a mean width of a quarter of a feature: one edge of the path holds it. A wider one comes off.
TEST_P(PathOpens, WhatHoldsACrumbStays) {
  for (const double height : {0.01, 0.04}) {
    Bench b(GetParam());
    ASSERT_TRUE(b.open({b.on_edge(0, 1, 0.3), b.inside(0.5, height), b.on_edge(0, 1, 0.7)}));
    const bool is_crumb = height < 0.02;
    EXPECT_EQ(b.opening.opened(), is_crumb ? 1 : 2);
    EXPECT_EQ(b.pieces(), is_crumb ? 1 : 2);
  }
}
// A path so short would only leave vertices in a strand.
TEST_P(PathOpens, NothingForACrumbAtTheEndOfAShortPath) {
  Bench b(GetParam());
  const std::uint64_t before = hash_of(b.body);
  EXPECT_FALSE(
      b.opening.open(std::vector<Stop>{b.on_edge(0, 1, 0.45), b.inside(0.5, 0.01), b.on_edge(0, 1, 0.55)}, {}));
  EXPECT_EQ(b.opening.refused(), 0);
  EXPECT_EQ(hash_of(b.body), before);
}

TEST_P(PathOpens, ToACornerOrAnEdgeWithinAFeatureOfAPointInside) {
  Bench b(GetParam());
  ASSERT_TRUE(b.open({b.on_edge(0, 1, 0.4), b.inside(0.505, 0.49)}));
  EXPECT_EQ(b.opening.made().back().value, 4);
  Bench c(GetParam());
  ASSERT_TRUE(c.open({c.on_edge(0, 1, 0.4), c.inside(0.31, 0.3)}));  // 0.007 m from the diagonal
  EXPECT_NEAR(c.last().x, 0.305, 1e-12);
  EXPECT_NEAR(c.last().y, 0.305, 1e-12);
  Bench d(GetParam());
  ASSERT_TRUE(d.open({d.on_edge(0, 1, 0.4), d.inside(0.335, 0.3)}));  // 0.025 m: farther than a feature
  EXPECT_LT(norm(d.last() - Vec3{0.335, 0.3, 0}), 1e-12);
}

TEST_P(PathOpens, ToNoBorderThatItDoesNotEndOn) {
  Bench b(GetParam());
  ASSERT_TRUE(b.open({b.vertex(4), b.inside(0.5, 0.01)}));  // half a feature before the border
  EXPECT_LT(norm(b.last() - Vec3{0.5, 0.01, 0}), 1e-12);
  EXPECT_EQ(b.pieces(), 1);
}

TEST_P(PathOpens, ASlitOfOneEdgeAsTwo) {
  Bench b(GetParam());
  const std::size_t vertices = b.body.collision.vertex_count();
  ASSERT_TRUE(b.open({b.vertex(4), b.inside(0.5, 0.2)}));
  EXPECT_EQ(b.body.collision.vertex_count(), vertices + 3);  // its end, its middle, and the middle's twin
  EXPECT_EQ(b.opening.opened(), 2);
}

TEST_P(PathOpens, FromBorderToBorderAndTwoPiecesAreLeft) {
  Bench b(GetParam());
  ASSERT_TRUE(b.open({b.on_edge(0, 1, 0.3), b.on_edge(0, 4, 0.5), b.on_edge(2, 0, 0.6)}));
  EXPECT_EQ(b.pieces(), 2);
  const double cut = 0.5 * 0.3 * 0.25 + 0.5 * 0.4 * 0.25;  // (0.3, 0), (0.25, 0.25), (0, 0.4) about the corner
  const std::vector<double> area = b.piece_areas();
  EXPECT_NEAR(std::min(area[0], area[1]), (GetParam() ? 2 : 1) * cut, 0.01 * cut);
}

TEST_P(PathOpens, AClosedPathAndAnIslandIsLeft) {
  Bench b(GetParam());
  const std::vector<Stop> ring{b.on_edge(0, 4, 0.5), b.on_edge(1, 4, 0.5), b.on_edge(3, 4, 0.5), b.on_edge(2, 4, 0.5)};
  std::vector<Stop> stops = ring;
  stops.push_back(ring[0]);
  ASSERT_TRUE(b.open(stops, true));
  EXPECT_EQ(b.pieces(), 2);
  const std::vector<double> area = b.piece_areas();
  EXPECT_NEAR(std::min(area[0], area[1]), (GetParam() ? 2 : 1) * 0.25, 0.003);
}

TEST_P(PathOpens, AlongABorderNothing) {
  Bench b(GetParam());
  const std::uint64_t before = hash_of(b.body);
  ASSERT_TRUE(b.open({b.vertex(0), b.vertex(1)}));
  EXPECT_EQ(b.pieces(), 1);
  EXPECT_EQ(hash_of(b.body), before);
}

TEST_P(PathOpens, NothingWhereStopsShareNoFace) {
  Bench b(GetParam());
  const std::uint64_t before = hash_of(b.body);
  EXPECT_FALSE(b.open({b.on_edge(0, 1, 0.3), b.on_edge(3, 2, 0.3)}));
  EXPECT_EQ(b.opening.uncut().reason, UncutReason::kNoEdge);
  EXPECT_LT(norm(b.opening.uncut().at - Vec3{0.7, 1, 0}), 1e-12);
  EXPECT_FALSE(b.open({b.vertex(0), b.inside(0.5, 0.8)}));
  EXPECT_EQ(b.opening.refused(), 2);
  EXPECT_EQ(hash_of(b.body), before);
}

INSTANTIATE_TEST_SUITE_P(Bodies, PathOpens, ::testing::Values(false, true),
                         [](const auto& which) { return which.param ? "closed" : "open"; });

// The drawn surface of a corner is laid flat, so that it encloses nothing: it may not come off.
TEST(PathOpens, NoPieceWithoutMaterial) {
  for (const bool flat : {false, true}) {
    Bench b(true);
    if (flat)
      for (std::size_t i = 0; i < b.body.visual.vertex_count(); ++i) {
        const VisualVertex v(static_cast<std::int32_t>(i));
        Vec3 p = b.body.visual.rest[v];
        if (p.x + p.y < 0.4) p.z = 0, b.body.visual.rest.set(v, p);
      }
    const std::uint64_t before = hash_of(b.body);
    const std::vector<Stop> corner{b.on_edge(0, 1, 0.1), b.on_edge(0, 4, 0.1), b.on_edge(2, 0, 0.9)};
    EXPECT_EQ(b.opening.open(corner, {}), !flat);
    EXPECT_EQ(b.opening.refused(), 0);
    EXPECT_EQ(b.pieces(), flat ? 1 : 2);
    EXPECT_EQ(hash_of(b.body) == before, flat);
  }
}

}  // namespace
}  // namespace kerf::path_opening_test
