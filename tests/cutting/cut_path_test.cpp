// The rules of start_cut and advance_cut, one by one, on one square in four triangles.
#include "kerf/cutting/cut_path.h"

#include "cutting/cut_body.h"

namespace kerf::cut_path_test {
namespace {

using namespace testing_support;

/// Corners 0 (0,0), 1 (1,0), 2 (0,1), 3 (1,1), centre 4; mean root edge 0.854, minimum feature 0.0205.
struct Square : CutBody {
  explicit Square(bool closed) : CutBody(grid_mesh(1, 1, 1, 1, [](int, int) { return true; }), [&] {
    SyntheticOptions o;
    o.closed = closed;
    o.subdivisions = 4;
    return o;
  }()) {
    options.flips = false;
  }
  /// The point (x, y) in the first triangle that holds it and, if given, touches `tip`.
  FacePoint at(double x, double y, CollisionVertex tip = {}) const {
    const CollisionMesh& m = body.collision;
    for (std::int32_t f = 0; f < static_cast<std::int32_t>(m.face_count()); ++f) {
      Vec3 p[3];
      bool touches = !tip.valid();
      for (int i = 0; i < 3; ++i) {
        const CollisionVertex v = m.origin[CollisionMesh::corner(CollisionTriangle(f), i)];
        p[i] = m.rest[v];
        touches = touches || v == tip;
      }
      const Vec3 q{x, y, 0};
      const auto area = [](Vec3 a, Vec3 b, Vec3 c) { return cross(b - a, c - a).z; };
      const double sum = area(p[0], p[1], p[2]);
      std::array<double, 3> w{area(q, p[1], p[2]) / sum, area(p[0], q, p[2]) / sum, area(p[0], p[1], q) / sum};
      if (!touches || w[0] < -1e-12 || w[1] < -1e-12 || w[2] < -1e-12) continue;
      for (double& x2 : w) x2 = std::max(0.0, x2);
      return {CollisionTriangle(f), w};
    }
    ADD_FAILURE() << "no triangle holds " << x << " " << y;
    return {};
  }
  CollisionVertex stab(double x, double y) {
    auto v = start_cut(body, at(x, y), options, scratch);
    EXPECT_TRUE(v.ok());
    expect_valid();
    return v.ok() ? *v : CollisionVertex{};
  }
  Advance lead(CollisionVertex tip, double x, double y) {
    auto a = advance_cut(body, tip, at(x, y, tip), options, scratch);
    EXPECT_TRUE(a.ok()) << (a.ok() ? "" : a.error().message);
    expect_valid();
    return a.ok() ? *a : Advance{};
  }
  Vec3 place(CollisionVertex v) const { return body.collision.rest[v]; }
};

class CutPath : public ::testing::TestWithParam<bool> {};

TEST_P(CutPath, AStabTakesCornersEdgesOrFaces) {
  Square s(GetParam());
  const std::size_t vertices = s.body.collision.vertex_count();
  EXPECT_EQ(s.stab(0.012, 0.01).value, 0);  // within the minimum feature of the corner
  EXPECT_EQ(s.stab(0.03, 0).value, 0);      // within twice that of it, on the border
  EXPECT_EQ(s.body.collision.vertex_count(), vertices);
  const CollisionVertex edge = s.stab(0.4, 0.01);  // within it of the border edge
  EXPECT_EQ(edge.index(), vertices);
  EXPECT_LT(norm(s.place(edge) - Vec3{0.4, 0, 0}), 1e-12);
  EXPECT_TRUE(s.body.collision.on_border(edge));
  const CollisionVertex inner = s.stab(0.7, 0.4);
  EXPECT_LT(norm(s.place(inner) - Vec3{0.7, 0.4, 0}), 1e-12);
  EXPECT_FALSE(s.body.collision.on_border(inner));
  const CollisionVertex diagonal = s.stab(0.22, 0.21);
  EXPECT_NEAR(s.place(diagonal).x, 0.215, 1e-12);
  EXPECT_EQ(s.stab(0.51, 0.5).value, 4);
}

TEST_P(CutPath, ABladeThatBarelyMovesDoesNothing) {
  Square s(GetParam());
  const CollisionVertex tip = s.stab(0.7, 0.4);
  const std::uint64_t before = hash_of(s.body);
  const Advance a = s.lead(tip, 0.71, 0.41);
  EXPECT_EQ(a.kind, Advance::Kind::kNothing);
  EXPECT_EQ(a.tip, tip);
  EXPECT_FALSE(a.opened);
  EXPECT_EQ(hash_of(s.body), before);
}

TEST_P(CutPath, InsideThenOverAnEdgeThenOut) {
  Square s(GetParam());
  const CollisionVertex tip = s.stab(0.8, 0.3);
  const Advance inside = s.lead(tip, 0.7, 0.42);
  EXPECT_EQ(inside.kind, Advance::Kind::kInside);
  EXPECT_TRUE(inside.opened);
  EXPECT_LT(norm(s.place(inside.tip) - Vec3{0.7, 0.42, 0}), 1e-12);
  EXPECT_TRUE(s.body.collision.on_border(inside.tip));  // the tip of a slit
  const Advance crossed = s.lead(inside.tip, 0.6, 0.6);
  EXPECT_EQ(crossed.kind, Advance::Kind::kAtEdge);
  EXPECT_LT(norm(s.place(crossed.tip) - Vec3{0.6, 0.6, 0}), 1e-12);
  const Advance out = s.lead(crossed.tip, 0.5, 1);
  EXPECT_EQ(out.kind, Advance::Kind::kRanOut);
  EXPECT_EQ(s.pieces(), 1);
  // The rim vertex fell apart: one twin, at the same place.
  int twins = 0;
  for_each_twin(s.body, out.tip, [&](CollisionVertex v) {
    ++twins;
    EXPECT_EQ(s.place(v), s.place(out.tip));
  });
  EXPECT_EQ(twins, 1);
  const Advance back = s.lead(tip, 1, 0.25);  // the other way from the stab
  EXPECT_EQ(back.kind, Advance::Kind::kRanOut);
  EXPECT_EQ(s.pieces(), 2);
}

TEST_P(CutPath, NearACornerThroughItNearAnEdgeAlongIt) {
  Square s(GetParam());
  const CollisionVertex from = s.stab(0.5, 0.12);
  const Advance corner = s.lead(from, 0.015, 0.002);  // the ray leaves near corner 0
  EXPECT_EQ(corner.tip.value, 0);
  EXPECT_EQ(corner.kind, Advance::Kind::kRanOut);
  Square t(GetParam());
  const CollisionVertex start = t.stab(0.2, 0.2);  // on the diagonal
  const Advance along = t.lead(start, 0.405, 0.40);  // nearer to the diagonal than the minimum feature
  EXPECT_TRUE(along.opened);
  EXPECT_NEAR(t.place(along.tip).x, t.place(along.tip).y, 1e-12);
  EXPECT_NEAR(t.place(along.tip).x, 0.4025, 1e-12);
}

TEST_P(CutPath, AlongABorderNothingIsOpened) {
  Square s(GetParam());
  const Advance a = s.lead(CollisionVertex(0), 0.6, 0.01);
  EXPECT_FALSE(a.opened);
  EXPECT_LT(norm(s.place(a.tip) - Vec3{0.6, 0, 0}), 1e-12);
  EXPECT_TRUE(a.on_border);
  EXPECT_NE(a.kind, Advance::Kind::kRanOut);
  EXPECT_EQ(s.pieces(), 1);
}

TEST_P(CutPath, RefusesATargetThatDoesNotTouchTheTip) {
  Square s(GetParam());
  EXPECT_FALSE(advance_cut(s.body, CollisionVertex(1), FacePoint{CollisionTriangle(2), {0.2, 0.3, 0.5}}, s.options, s.scratch).ok());
}

INSTANTIATE_TEST_SUITE_P(Bodies, CutPath, ::testing::Values(false, true), [](const auto& which) {
  return which.param ? "closed" : "open";
});

}  // namespace
}  // namespace kerf::cut_path_test
