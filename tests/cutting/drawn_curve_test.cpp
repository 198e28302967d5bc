// Lips run along the curve that the blade drew, however coarse the collision mesh is that follows by chords.
#include <algorithm>
#include <cmath>

#include "support/piece_volumes.h"

#include "cutting/stroke_body.h"

namespace kerf::drawn_curve_test {
namespace {

using namespace testing_support;

/// The drawn lips: rows of places from one vertex of the path to the next, metres.
std::vector<std::vector<Vec2>> lips_of(const CellComplex& body) {
  const CollisionMesh& mesh = body.collision;
  const auto place = [&](VisualVertex v) { return Vec2{body.visual.rest[v].x, body.visual.rest[v].y}; };
  std::vector<std::vector<Vec2>> lips;
  for (const CollisionHalfEdge h : body.wall_edge.raw())
    for (std::size_t s = 0; s < 2; ++s) {
      std::vector<Vec2>& lip = lips.emplace_back(1, place(mesh.bound[mesh.from(h)][s]));
      const PoolRun run = mesh.chain[h][s];
      for (std::int32_t i = 0; i < run.count; ++i) lip.push_back(place(body.chain_pool[run.at(i)]));
      lip.push_back(place(mesh.bound[mesh.to(h)][s]));
    }
  return lips;
}

/// Distances of lips from what was drawn, in mean edges, rising: of their vertices and the middles between.
template <class Distance>
std::vector<double> distances(const StrokeBody& b, Distance&& distance) {
  std::vector<double> all;
  for (const auto& lip : lips_of(b.body))
    for (std::size_t i = 0; i < lip.size(); ++i) {
      all.push_back(distance(lip[i]) / b.body.mean_root_edge);
      if (i + 1 < lip.size()) all.push_back(distance(0.5 * (lip[i] + lip[i + 1])) / b.body.mean_root_edge);
    }
  std::sort(all.begin(), all.end());
  return all;
}
double share(const std::vector<double>& rising, double part) {
  return rising[static_cast<std::size_t>(part * static_cast<double>(rising.size() - 1))];
}

Stroke circle(Vec2 centre, double radius, int poses, double first = 0) {
  Stroke s;
  for (int i = 0; i < poses; ++i)
    s.push_back(centre + radius * Vec2{std::cos(first + 2 * M_PI * i / poses), std::sin(first + 2 * M_PI * i / poses)});
  s.push_back(s.front());
  return s;
}

struct Case {
  const char* model;
  std::size_t visual_triangles;
};
class DrawnCurve : public ::testing::TestWithParam<Case> {};

TEST_P(DrawnCurve, OfACircleIsRound) {
  StrokeBody b(GetParam().model, GetParam().visual_triangles);
  const double edge = b.body.mean_root_edge, radius = 2.3 * edge;
  const Vec3 middle = b.box.center();
  Random random(5);
  std::vector<double> all;
  for (int i = 0; i < 6; ++i) {
    const Vec2 centre{middle.x + random.uniform(-0.6, 0.6) * edge, middle.y + random.uniform(-0.6, 0.6) * edge};
    b.make_whole();
    b.cut(circle(centre, radius, 120, random.uniform(0, 6)), 1);
    EXPECT_EQ(b.refused, 0);
    ASSERT_EQ(b.pieces(), 2);
    const Status valid = validate_complex(b.body, b.start);
    EXPECT_TRUE(valid.ok()) << valid.error().message;
    const auto off = distances(b, [&](Vec2 p) { return std::abs(norm(p - centre) - radius); });
    all.insert(all.end(), off.begin(), off.end());
  }
  std::sort(all.begin(), all.end());
  EXPECT_LT(share(all, 0.5), 0.0015);
  EXPECT_LT(share(all, 0.95), 0.006);
  EXPECT_LT(all.back(), b.options.path_tolerance + b.options.minimum_feature);
}

// Any smooth curve, with poses so dense that the polyline through them is the curve.
TEST_P(DrawnCurve, OfAWaveIsAWave) {
  StrokeBody b(GetParam().model, GetParam().visual_triangles);
  const double edge = b.body.mean_root_edge;
  const Vec3 middle = b.box.center(), size = b.box.size();
  Random random(7);
  std::vector<double> all;
  for (int i = 0; i < 6; ++i) {
    const double turn = random.uniform(0, 6.28), height = random.uniform(0.2, 0.5) * edge,
                 length = random.uniform(3, 5) * edge;
    const Vec2 x{std::cos(turn), std::sin(turn)}, y{-x.y, x.x};
    Stroke s;
    const double reach = 0.35 * std::min(size.x, size.y);
    for (int k = 0; k <= 150; ++k) {
      const double t = reach * (k / 75.0 - 1);
      s.push_back(Vec2{middle.x, middle.y} + t * x + height * std::sin(2 * M_PI * t / length) * y);
    }
    b.make_whole();
    b.cut(s, 1);
    EXPECT_EQ(b.refused, 0);
    const Status valid = validate_complex(b.body, b.start);
    EXPECT_TRUE(valid.ok()) << valid.error().message;
    const auto off = distances(b, [&](Vec2 p) {
      double near = HUGE_VAL;
      for (std::size_t k = 0; k + 1 < s.size(); ++k) near = std::min(near, StrokeJudge::distance(p, s[k], s[k + 1]));
      return near;
    });
    all.insert(all.end(), off.begin(), off.end());
  }
  std::sort(all.begin(), all.end());
  EXPECT_LT(share(all, 0.5), 0.003);
  EXPECT_LT(share(all, 0.95), 0.01);
}

INSTANTIATE_TEST_SUITE_P(Bodies, DrawnCurve,
                         ::testing::Values(Case{"closed-sheet", 2500}, Case{"closed-sheet", 40000}, Case{"steak", 0}),
                         [](const auto& c) {
                           return std::string(c.param.model == std::string_view("steak") ? "steak" : "sheet") +
                                  std::to_string(c.param.visual_triangles);
                         });

/// Circles of all sizes with 360 poses each, from anywhere on them: fn(body, middle, radius in metres).
template <class Fn>
void for_circles(StrokeBody& b, double radius, Fn&& fn) {
  const double edge = b.body.mean_root_edge;
  const Vec3 middle = b.box.center();
  Random random(5);
  for (int i = 0; i < 12; ++i) {
    const Vec2 at{middle.x + random.uniform(-0.6, 0.6) * edge, middle.y + random.uniform(-0.6, 0.6) * edge};
    b.make_whole();
    b.cut(circle(at, radius * edge, 360, random.uniform(0, 6)), 1);
    EXPECT_EQ(b.refused, 0);
    ASSERT_EQ(b.pieces(), 2);
    const Status valid = validate_complex(b.body, b.start);
    ASSERT_TRUE(valid.ok()) << valid.error().message;
    fn(at, radius * edge);
  }
}

// More bends are more vertices. Were each moved aside where an edge is near, finer paths would be rougher.
TEST(DrawnCurves, AFinerToleranceIsNotRougher) {
  for (const double radius : {0.25, 0.5, 1.0, 1.5}) {
    double coarser = HUGE_VAL;
    for (const double tolerance : {0.048, 0.024, 0.012, 0.006, 0.003}) {
      StrokeBody b("steak");
      b.options.path_tolerance = tolerance;
      double sum = 0, most = 0;
      std::size_t count = 0;
      for_circles(b, radius, [&](Vec2 at, double r) {
        for (const double off : distances(b, [&](Vec2 p) { return std::abs(norm(p - at) - r); })) {
          sum += off * off;
          most = std::max(most, off);
          ++count;
        }
      });
      const double rms = std::sqrt(sum / static_cast<double>(count));
      EXPECT_LT(rms, 1.1 * coarser) << "radius " << radius << ", tolerance " << tolerance;
      EXPECT_LT(rms, std::max(0.003, 0.15 * tolerance)) << "radius " << radius << ", tolerance " << tolerance;
      EXPECT_LT(most, 0.024 + tolerance) << "radius " << radius << ", tolerance " << tolerance;
      coarser = std::min(coarser, rms);
    }
  }
}

// A path leaves its blade where it goes through vertices that were there; its own are where the blade was.
TEST(DrawnCurves, BendWhereTheBladeWas) {
  StrokeBody b("steak");
  const double edge = b.body.mean_root_edge;
  const CollisionVertex first_own(b.body.collision.vertex_count());
  int own = 0, aside = 0;
  for (const double tolerance : {0.024, 0.006})
    for (const double radius : {0.5, 1.0}) {
      b.options.path_tolerance = tolerance;
      for_circles(b, radius, [&](Vec2 at, double r) {
        const CollisionMesh& mesh = b.body.collision;
        for (const CollisionHalfEdge h : b.body.wall_edge.raw())
          if (mesh.from(h) >= first_own) {
            const Vec3 p = mesh.rest[mesh.from(h)];
            ++own;
            aside += std::abs(norm(Vec2{p.x, p.y} - at) - r) > 0.2 * b.options.minimum_feature * edge;
          }
      });
    }
  // A path that begins in a face has a vertex in the middle of its first chord.
  EXPECT_LT(aside, own / 12) << own;
}

// Teeth and kinks of what is drawn. The rest is where the path goes through a vertex that was there.
TEST(DrawnCurves, OfACircleHasFewCorners) {
  for (const double radius : {0.5, 1.0, 1.5}) {
    StrokeBody b("steak");
    std::vector<double> corners;  // degrees, between the drawn edges of one chord
    for_circles(b, radius, [&](Vec2, double) {
      for (const auto& lip : lips_of(b.body))
        for (std::size_t i = 1; i + 1 < lip.size(); ++i) {
          const Vec2 in = lip[i] - lip[i - 1], out = lip[i + 1] - lip[i];
          corners.push_back(std::abs(std::atan2(cross(in, out), dot(in, out))) * 180 / M_PI);
        }
    });
    std::sort(corners.begin(), corners.end());
    EXPECT_LT(share(corners, 0.99), 15) << radius;
  }
}

// The island has the volume of a cylinder, not of a prism with as many corners as the path.
TEST(DrawnCurves, CloseAroundTheirVolume) {
  for (const std::size_t triangles : {2500, 40000}) {
    StrokeBody b("closed-sheet", triangles);
    const double radius = 2.3 * b.body.mean_root_edge, whole = b.box.size().x * b.box.size().y * b.start.size.z;
    b.cut(circle({0.02, -0.03}, radius, 120), 1);
    std::vector<double> volumes = piece_volumes(b.body);
    ASSERT_EQ(volumes.size(), 2U);
    std::sort(volumes.begin(), volumes.end());
    EXPECT_NEAR(volumes[0] + volumes[1], whole, 1e-9 * whole);
    EXPECT_NEAR(volumes[0] / (M_PI * radius * radius * b.start.size.z), 1, 0.004);
  }
}

// A straight stroke is its chords: nothing is moved, and no vertex is made but where lips cross edges.
TEST(DrawnCurves, OfAStraightStrokeAreChords) {
  for (const int poses : {1, 40}) {
    StrokeBody b("closed-sheet", 2500);
    b.cut({{-0.6, 0.113}, {0.7, 0.241}}, poses);
    const auto off = distances(b, [&](Vec2 p) { return StrokeJudge::distance(p, {-0.6, 0.113}, {0.7, 0.241}); });
    EXPECT_LT(share(off, 0.9), 0.005) << poses;
    EXPECT_LT(off.back(), b.options.path_tolerance) << poses;
  }
}

// Into the body and out of it again over one edge of its rim, with no edge of the mesh in between.
TEST(DrawnCurves, BiteOffWhatOneEdgeOfTheRimHolds) {
  StrokeBody b("closed-sheet", 2500);
  const double edge = b.body.mean_root_edge;
  int bites = 0;
  for (const auto& [from, to] : b.outline) {
    const Vec2 along = (1 / norm(to - from)) * (to - from), inward{-along.y, along.x}, middle = lerp(from, to, 0.5);
    for (const double depth : {0.03, 0.05}) {
      const double half = 0.3 * norm(to - from), deep = depth * edge, radius = (half * half + deep * deep) / (2 * deep),
                   angle = 1.3 * std::asin(half / radius);
      Stroke s;
      for (int i = -30; i <= 30; ++i)
        s.push_back(middle + radius * std::sin(angle * i / 30) * along +
                    (deep - radius * (1 - std::cos(angle * i / 30))) * inward);
      b.make_whole();
      b.cut(s, 1);
      EXPECT_EQ(b.refused, 0) << depth << text_of({s});
      EXPECT_EQ(b.pieces(), 2) << depth << text_of({s});
      const Status valid = validate_complex(b.body, b.start);
      EXPECT_TRUE(valid.ok()) << valid.error().message;
      ++bites;
    }
  }
  EXPECT_GT(bites, 40);
}

// A blade that stands in the material, and trembles, gathers nothing.
TEST(DrawnCurves, OfABladeThatStandsAreShort) {
  StrokeBody b("closed-sheet", 2500);
  const double edge = b.body.mean_root_edge;
  for (const Vec2 p : {Vec2{-0.6, 0.11}, Vec2{-0.1, 0.13}}) b.move(p);
  for (int i = 0; i < 5000; ++i) b.move({-0.1 + 3e-4 * edge * std::sin(i), 0.13 + 3e-4 * edge * std::cos(i)});
  ASSERT_FALSE(b.stroke.ends.empty());
  EXPECT_LT(b.stroke.ends[0].trail.size(), 10u);
}

// Corners stay: the tip of a V is where the blade turned.
TEST(DrawnCurves, KeepCorners) {
  StrokeBody b("closed-sheet", 2500);
  const Vec2 tip{0.311, 0.157};
  b.cut({{-0.5, -0.3}, tip, {-0.4, 0.6}}, 40);
  double nearest = HUGE_VAL;
  for (const auto& lip : lips_of(b.body))
    nearest = std::min({nearest, norm(lip.front() - tip), norm(lip.back() - tip)});
  EXPECT_LT(nearest / b.body.mean_root_edge, 0.03);
}

}  // namespace
}  // namespace kerf::drawn_curve_test
