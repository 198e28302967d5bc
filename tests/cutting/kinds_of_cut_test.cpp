// The kinds of cuts that surgeons and cooks make, on open sheets and closed bodies, against counts and measures known
// beforehand. Every cut is followed by validate_complex.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "cutting/cut_body.h"

namespace kerf::kinds_of_cut_test {
namespace {

using namespace testing_support;

class KindsOfCut : public ::testing::TestWithParam<bool> {
 protected:
  CutBody sheet(int subdivisions = 3) { return CutBody::sheet(subdivisions, GetParam()); }
  /// Cuts that must not be refused.
  static PolylineCut cut(CutBody& b, const std::vector<Vec3>& path) {
    const PolylineCut r = b.cut(path);
    EXPECT_EQ(b.refused, 0);
    return r;
  }
};

double length_of_open_borders(const CutBody& b) {
  const CollisionMesh& m = b.body.collision;
  double sum = 0;
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(m.half_edge_count()); ++i)
    if (const CollisionHalfEdge h(i); m.is_border(h)) sum += norm(m.rest[m.to(h)] - m.rest[m.from(h)]);
  return sum;
}

TEST_P(KindsOfCut, StraightAcross) {
  CutBody b = sheet();
  const PolylineCut r = cut(b, {{-0.1, 0.43, 0}, {1.1, 0.43, 0}});
  EXPECT_FALSE(r.tip.valid());
  EXPECT_EQ(b.pieces(), 2);
  // Both lips are new border, straight within the snap distance.
  EXPECT_NEAR(length_of_open_borders(b), 4 + 2, 0.01);
  if (GetParam()) {
    const auto volume = piece_volumes(b.body);  // ascending
    ASSERT_EQ(volume.size(), 2u);
    EXPECT_NEAR(volume[0] + volume[1], b.start.volume, 1e-12);
    EXPECT_GT(volume[0], 0.40 * b.start.volume);
    EXPECT_LT(volume[0], 0.45 * b.start.volume);
  }
}

TEST_P(KindsOfCut, PartialThenLongerThenThrough) {
  CutBody b = sheet();
  const PolylineCut first = cut(b, {{-0.1, 0.43, 0}, {0.4, 0.45, 0}});
  ASSERT_TRUE(first.tip.valid());
  EXPECT_EQ(b.pieces(), 1);
  const Vec3 tip = b.body.collision.rest[first.tip];
  EXPECT_LT(norm(tip - Vec3{0.4, 0.45, 0}), 0.01);
  cut(b, {tip, {0.7, 0.6, 0}});  // on from the old tip
  EXPECT_EQ(b.pieces(), 1);
  cut(b, {{0.7, 0.6, 0}, {1.1, 0.6, 0}});
  EXPECT_EQ(b.pieces(), 2);
}

TEST_P(KindsOfCut, CrossingMakesFourQuarters) {
  CutBody b = sheet();
  cut(b, {{-0.1, 0.47, 0}, {1.1, 0.47, 0}});
  cut(b, {{0.53, -0.1, 0}, {0.53, 1.1, 0}});
  EXPECT_EQ(b.pieces(), 4);
}

TEST_P(KindsOfCut, LinesOfTheGridStayStraightWhereTheyMeet) {
  // Each crosses the other at a vertex, where paths may not be rounded to a place beside it.
  const int n = 8;
  for (const bool back : {false, true})
    for (int k = 1; k < n; ++k) {
      SyntheticOptions options;
      options.subdivisions = 1;
      options.closed = GetParam();
      CutBody b(plain_grid_mesh(n, n), options);
      const double x = static_cast<double>(k) / n, y = static_cast<double>((3 * k) % n) / n;
      cut(b, {{x, -0.1, 0}, {x, 1.1, 0}});
      cut(b, back ? std::vector<Vec3>{{1.1, y, 0}, {-0.1, y, 0}} : std::vector<Vec3>{{-0.1, y, 0}, {1.1, y, 0}});
      EXPECT_EQ(b.pieces(), 4) << k;
      const CollisionMesh& m = b.body.collision;
      for (const CollisionVertex v : ids<CollisionVertex>(m.vertex_count())) {
        if (!m.on_border(v)) continue;
        const Vec3 p = m.rest[v];
        const double off = std::min({std::fabs(p.x - x), std::fabs(p.y - y), p.x, 1 - p.x, p.y, 1 - p.y});
        EXPECT_LT(off, 1e-9) << back << " " << k << ": " << p.x << " " << p.y;
      }
    }
}

TEST_P(KindsOfCut, ManyParallelAndCrossingStrips) {
  CutBody b = sheet(2);
  const int n = 7;
  for (int i = 1; i <= n; ++i) cut(b, {{-0.1, (i + 0.13) / (n + 1), 0}, {1.1, (i + 0.13) / (n + 1), 0}});
  EXPECT_EQ(b.pieces(), n + 1);
  for (int i = 1; i <= n; ++i) cut(b, {{(i + 0.21) / (n + 1), -0.1, 0}, {(i + 0.21) / (n + 1), 1.1, 0}});
  EXPECT_EQ(b.pieces(), (n + 1) * (n + 1));
}

TEST_P(KindsOfCut, TJunctionStaysOnePieceUntilItIsClosed) {
  CutBody b = sheet();
  cut(b, {{0.2, 0.47, 0}, {0.8, 0.47, 0}});
  cut(b, {{0.5, -0.1, 0}, {0.5, 0.46, 0}, {0.5, 0.4702, 0}});
  EXPECT_EQ(b.pieces(), 1);
  cut(b, {{0.2, 0.47, 0}, {0.2, -0.1, 0}});  // from an old tip to the rim
  EXPECT_EQ(b.pieces(), 2);
}

TEST_P(KindsOfCut, SelfCrossingLoopLeavesAnIsland) {
  CutBody b = sheet();
  // An alpha: in at the left, round, across its own path, out at the bottom.
  cut(b, {{0.2, 0.3, 0}, {0.75, 0.35, 0}, {0.8, 0.65, 0}, {0.55, 0.75, 0}, {0.43, 0.6, 0}, {0.47, 0.12, 0}});
  EXPECT_EQ(b.pieces(), 2);
}

TEST_P(KindsOfCut, ClosedLoopsNested) {
  CutBody b = sheet();
  int pieces = 1;
  for (const double radius : {0.4, 0.3, 0.2, 0.1}) {
    cut(b, circle_points({0.5, 0.5, 0}, radius, 80));
    EXPECT_EQ(b.pieces(), ++pieces) << radius;
  }
}

TEST_P(KindsOfCut, ASpiralStaysOnePiece) {
  CutBody b = sheet();
  std::vector<Vec3> points;
  for (int i = 0; i <= 150; ++i) {
    const double angle = 0.12 * i, radius = 0.08 + 0.0024 * i;
    points.push_back({0.5 + radius * std::cos(angle), 0.5 + radius * std::sin(angle), 0});
  }
  cut(b, points);
  EXPECT_EQ(b.pieces(), 1);
}

TEST_P(KindsOfCut, AlongEdgesAndThroughVertices) {
  CutBody b = sheet();
  // The grid's own lines: y = 1/2 runs along edges and through vertices, the diagonal through vertices.
  cut(b, {{0, 0.5, 0}, {1, 0.5, 0}});
  EXPECT_EQ(b.pieces(), 2);
  cut(b, {{0, 0, 0}, {1, 1, 0}});
  EXPECT_EQ(b.pieces(), 4);
  CutBody c = sheet();
  cut(c, {{1.0 / 6, 1.0 / 6, 0},
          {5.0 / 6, 1.0 / 6, 0},
          {5.0 / 6, 5.0 / 6, 0},
          {1.0 / 6, 5.0 / 6, 0},
          {1.0 / 6, 1.0 / 6, 0}});
  EXPECT_EQ(c.pieces(), 2);
}

TEST_P(KindsOfCut, RepeatsCutNothingNew) {
  for (const double shift : {0.0, 1e-12, 1e-9, 1e-6, 1e-4, 1e-3}) {
    CutBody b = sheet();
    const std::vector<Vec3> path{{0.13, 0.22, 0}, {0.81, 0.67, 0}};
    const PolylineCut first = cut(b, path);
    EXPECT_GT(first.opened_edges, 5);
    for (const bool reversed : {false, true}) {
      std::vector<Vec3> again = path;
      for (Vec3& p : again) p += Vec3{shift, -shift, 0};
      if (reversed) std::reverse(again.begin(), again.end());
      const PolylineCut r = cut(b, again);
      EXPECT_EQ(r.opened_edges, 0) << "shift " << shift;
      EXPECT_EQ(b.pieces(), 1);
    }
  }
}

TEST_P(KindsOfCut, RepeatsOfACutAcrossMakeNoSlivers) {
  // The lip itself may lie a minimum feature beside its line, and a tenth of one more is the same lip (kPathNear).
  for (const double shift : {0.0, 1e-12, 1e-9, 1e-6, 1e-4, 3e-4}) {
    CutBody b = sheet();
    cut(b, {{-0.1, 0.43, 0}, {1.1, 0.51, 0}});
    cut(b, {{-0.1, 0.43 + shift, 0}, {1.1, 0.51 - shift, 0}});
    cut(b, {{1.1, 0.51 + shift, 0}, {-0.1, 0.43, 0}});
    EXPECT_EQ(b.pieces(), 2) << shift;
  }
}

TEST_P(KindsOfCut, ReentryAcrossSlits) {
  CutBody b = sheet();
  for (const double x : {0.3, 0.5, 0.7}) cut(b, {{x + 0.01, 0.3, 0}, {x + 0.01, 0.7, 0}});
  EXPECT_EQ(b.pieces(), 1);
  cut(b, {{-0.1, 0.52, 0}, {1.1, 0.49, 0}});
  EXPECT_EQ(b.pieces(), 2);
}

TEST_P(KindsOfCut, RingsAndHoles) {
  SyntheticOptions o;
  o.closed = GetParam();
  CutBody b(annulus_mesh(0.3, 1, 16, 3), o);
  cut(b, {{0.65, 0.02, 0}, {1.2, 0.05, 0}});  // to the outer rim
  EXPECT_EQ(b.pieces(), 1);
  cut(b, {{0.03, -1.1, 0}, {0.01, 1.1, 0}});  // rim, hole, rim
  EXPECT_EQ(b.pieces(), 2);
  CutBody c(annulus_mesh(0.3, 1, 16, 3), o);
  cut(c, circle_points({0, 0, 0}, 0.6, 60));  // round the hole
  EXPECT_EQ(c.pieces(), 2);
  CutBody d(annulus_mesh(0.3, 1, 16, 3), o);
  cut(d, {{0.1, 0.01, 0}, {1.2, 0.01, 0}});  // one radial cut opens the ring
  EXPECT_EQ(d.pieces(), 1);
}

TEST_P(KindsOfCut, StabsOfEverySize) {
  for (const double size : {1e-9, 1e-6, 1e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1}) {
    CutBody b = sheet();
    const PolylineCut r = cut(b, {{0.312, 0.431, 0}, {0.312 + size, 0.431 + 0.3 * size, 0}});
    EXPECT_EQ(b.pieces(), 1);
    if (size < 3e-3) {
      EXPECT_EQ(r.opened_edges, 0);  // a blade that barely moved
    }
    if (size > 0.03) {
      EXPECT_GT(r.opened_edges, 0);
    }
  }
}

TEST_P(KindsOfCut, FineTolerances) {
  CutBody b = sheet();
  b.options.minimum_feature = 0;  // kLeastFeature holds
  b.options.path_tolerance = 0;
  cut(b, {{-0.1, 0.5 + 1e-7, 0}, {1.1, 0.5 - 1e-7, 0}});
  cut(b, circle_points({0.5, 0.5, 0}, 1.0 / 3, 100));
  cut(b, {{0.5, 0.5, 0}, {0.5 + 1e-3, 1.1, 0}});
  EXPECT_GE(b.pieces(), 4);
}

// Where its rays meet there are only crumbs. The ray towards the hole is eight minimum features long, and parts material all the same.
TEST_P(KindsOfCut, AStarBesideAHoleWithTheLargestMinimumFeature) {
  SyntheticOptions o;
  o.closed = GetParam();
  o.subdivisions = 1;
  for (int i = 0; i < 40; ++i) {
    CutBody b(annulus_mesh(0.25, 1, 24, 9), o);
    b.options.minimum_feature = 0.25;
    const double towards = 0.05 + 0.01 * i;
    const auto point = [](double r, double angle) { return Vec3{r * std::cos(angle), r * std::sin(angle), 0}; };
    const Vec3 centre = point(0.39, towards);
    for (int ray = 0; ray < 4; ++ray)
      b.cut({centre, centre + point(2.5, towards + 1.24 + 0.5 * std::numbers::pi * ray)}, false);
    EXPECT_EQ(b.refused, 0) << i;
    EXPECT_GE(b.pieces(), 4) << i;
  }
}

TEST_P(KindsOfCut, EveryScaleAndPlace) {
  for (const double scale : {1e-4, 1.0, 1e4}) {
    TriangleMesh mesh = sheet_65_mesh();
    const Vec3 far = scale * Vec3{1000, -2000, 500};
    for (Vec3& p : mesh.positions) p = far + scale * p;
    SyntheticOptions o;
    o.closed = GetParam();
    o.thickness = 0.1 * scale;
    CutBody b(mesh, o);
    cut(b, {far + scale * Vec3{-0.1, 0.43, 0}, far + scale * Vec3{1.1, 0.47, 0}});
    cut(b, {far + scale * Vec3{0.53, 1.1, 0}, far + scale * Vec3{0.48, -0.1, 0}});
    EXPECT_EQ(b.pieces(), 4) << scale;
  }
}

TEST_P(KindsOfCut, BentSheets) {
  SyntheticOptions o;
  o.closed = GetParam();
  const double radius = 1 / 2.5;
  CutBody b(bent_mesh(sheet_65_mesh(), radius), o);
  const auto at = [&](double x, double y) {
    return Vec3{radius * std::sin(x / radius), y, radius * (std::cos(x / radius) - 1)};
  };
  std::vector<Vec3> path;
  for (int i = 0; i <= 40; ++i) path.push_back(at(-0.05 + 1.1 * i / 40, 0.4 + 0.1 * std::sin(0.2 * i)));
  cut(b, path);
  EXPECT_EQ(b.pieces(), 2);
  cut(b, {at(0.52, -0.1), at(0.52, 1.1)});
  EXPECT_EQ(b.pieces(), 4);
}

/// Texture coordinates of the synthetic bodies are the rest positions (x, y): a linear map, so that every interpolated
/// corner must still agree with its vertex.
TEST_P(KindsOfCut, TextureIsInterpolated) {
  CutBody b = sheet();
  cut(b, circle_points({0.5, 0.5, 0}, 0.3, 60));
  cut(b, {{-0.1, 0.43, 0}, {1.1, 0.52, 0}});
  cut(b, {{0.31, 0.2, 0}, {0.61, 0.9, 0}});
  const VisualMesh& m = b.body.visual;
  int walls = 0;
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(m.half_edge_count()); ++i) {
    const VisualHalfEdge h(i);
    if (m.patch[VisualMesh::face(h)].is_wall()) {
      ++walls;
      continue;
    }
    const Vec3 p = m.rest[m.from(h)];
    ASSERT_NEAR(m.texture[h].x, p.x, 1e-6);
    ASSERT_NEAR(m.texture[h].y, p.y, 1e-6);
  }
  EXPECT_EQ(walls > 0, GetParam());
}

INSTANTIATE_TEST_SUITE_P(Bodies, KindsOfCut, ::testing::Values(false, true),
                         [](const auto& which) { return which.param ? "closed" : "open"; });

TEST(Walls, HaveLengthsInMetresAndTheChosenLayers) {
  for (const int layers : {1, 2, 5}) {
    CutBody b = CutBody::sheet(3, true);
    b.options.layers = layers;
    b.cut({{0.2, 0.43, 0}, {0.8, 0.47, 0}});
    ASSERT_EQ(b.refused, 0);
    const VisualMesh& m = b.body.visual;
    const CollisionMesh& c = b.body.collision;
    std::size_t lines = 0;
    for (std::int32_t i = 0; i < static_cast<std::int32_t>(c.vertex_count()); ++i) {
      const CollisionVertex v(i);
      if (!c.line[v].exists()) continue;
      ++lines;
      EXPECT_EQ(c.line[v].count, layers - 1);
    }
    EXPECT_GT(lines, 4u);
    // Across the thickness the texture measures metres exactly, along the cut it is the mean of both sides.
    for (std::size_t f = 0; f < m.face_count(); ++f) {
      if (!m.patch[VisualTriangle(f)].is_wall()) continue;
      for (int i = 0; i < 3; ++i) {
        const VisualHalfEdge h = VisualMesh::corner(VisualTriangle(f), i), n = VisualMesh::next(h);
        const double du = m.texture[n].x - m.texture[h].x, dv = m.texture[n].y - m.texture[h].y;
        const double length = norm(m.rest[m.to(h)] - m.rest[m.from(h)]);
        if (m.planar[h].x == m.planar[n].x) {
          EXPECT_NEAR(std::fabs(dv), length, 1e-6);
        }
        EXPECT_NEAR(std::hypot(du, dv), length, 0.05 * length + 0.02);
      }
    }
  }
}

TEST(Walls, RoughnessMovesBothLipsAlike) {
  CutBody b = CutBody::sheet(3, true);
  b.options.roughness = 0.4;
  b.options.layers = 4;
  b.cut({{-0.1, 0.43, 0}, {1.1, 0.47, 0}});
  ASSERT_EQ(b.refused, 0);
  const VisualMesh& m = b.body.visual;
  // Every inner wall vertex has a partner at the same place on the other lip, and they are not all in one plane.
  std::vector<Vec3> points;
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(m.vertex_count()); ++i)
    if (m.free[VisualVertex(i)] && m.patch[VisualMesh::face(m.outgoing[VisualVertex(i)])].is_wall())
      points.push_back(m.rest[VisualVertex(i)]);
  ASSERT_GT(points.size(), 20u);
  const auto less = [](Vec3 a, Vec3 c) { return a.x != c.x ? a.x < c.x : a.y != c.y ? a.y < c.y : a.z < c.z; };
  std::sort(points.begin(), points.end(), less);
  ASSERT_EQ(points.size() % 2, 0u);
  for (std::size_t i = 0; i < points.size(); i += 2) EXPECT_EQ(points[i], points[i + 1]);
}

}  // namespace
}  // namespace kerf::kinds_of_cut_test
