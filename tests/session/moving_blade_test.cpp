// Bodies that move between the poses of a stroke by hand. What the blade has met of them at rest is known from where each pose lies in the material at its
// time: by closed form where the body falls, by a search of all triangles where it swings.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "cutting/stroke_body.h"
#include "session/make_session.h"

namespace kerf::moving_blade_test {
namespace {

using namespace testing_support;

constexpr double kStep = 0.01, kReach = 0.3;
/// Mean collision edges: beside its cut soft material gives way, and a place of the world lies in either lip.
constexpr double kGivesWay = 0.08;
constexpr int kParts = 8;  // of the way between two poses

SceneFix left_side() {
  SceneFix fix;
  fix.region.min = {-1, -1, -1};
  fix.region.max = {-0.45, 1, 1};
  return fix;
}

/// A sheet of 1 x 1 x 0.1 m, soft, that weighs in its plane. Fixed: it swings on its left side.
Scene sheet(Vec3 gravity, bool fixed) {
  Scene scene;
  scene.body.model = "closed-sheet";
  scene.body.options.collision_triangles = 800;
  scene.body.options.visual_triangles = 4000;
  scene.material.young = 3e4;
  scene.material.density = 1000;
  scene.material.damping_mass = 0;
  scene.simulation.gravity = gravity;
  scene.simulation.time_step = kStep;
  if (fixed) scene.fixes.push_back(left_side());
  return scene;
}

/// What a stroke by hand has met of a body, at rest, and the judge of what came apart.
class Moving {
 public:
  explicit Moving(const Scene& scene) : session_(test::make(scene)), judged_("closed-sheet") {
    judged_.body = session_.body().complex;
    judged_.box = {};
    judged_.outline.clear();
    const CollisionMesh& mesh = judged_.body.collision;
    for (const Vec3& p : mesh.rest.raw()) judged_.box.add(p);
    for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(mesh.half_edge_count())) {
      const Vec3 a = mesh.rest[mesh.from(h)], b = mesh.rest[mesh.to(h)];
      if (mesh.is_border(h)) judged_.outline.push_back({{{a.x, a.y}, {b.x, b.y}}});
    }
  }
  [[nodiscard]] double edge() const { return judged_.body.mean_root_edge; }
  [[nodiscard]] Session& session() { return session_; }

  /// Poses along a stroke in the world, with so many steps between two; `add_met(place, at_rest)` adds what the blade has met on the way there.
  template <class AddMet>
  void cut(const Stroke& path, int poses, int steps, AddMet&& add_met) {
    ASSERT_TRUE(session_.begin_stroke(SceneFrame::kWorld, false).ok());
    Stroke at_rest;
    const auto pose = [&](Vec2 p) {
      add_met(p, at_rest);
      const Status moved = session_.move_blade({p.x, p.y, kReach}, {p.x, p.y, -kReach});
      ASSERT_TRUE(moved.ok()) << moved.error().message;
      before_ = session_.collision_positions();
    };
    pose(path[0]);
    for (std::size_t k = 0; k + 1 < path.size(); ++k)
      for (int i = 1; i <= poses; ++i) {
        ASSERT_TRUE(session_.step(steps).ok());
        pose(lerp(path[k], path[k + 1], static_cast<double>(i) / poses));
      }
    ASSERT_TRUE(session_.end_stroke().ok());
    strokes_.push_back(at_rest);
  }

  /// Pieces are those of the strokes, and walls stand where these went, within so many edges.
  void expect_cut(double off, const std::string& what) {
    judged_.body = session_.body().complex;
    const auto verdict =
        StrokeJudge{0.12 * edge() + off * edge(), 0.9 * judged_.options.minimum_feature * edge()}.judge(judged_,
                                                                                                        strokes_);
    EXPECT_EQ(verdict.bridges, 0) << what;
    EXPECT_EQ(verdict.severed, 0) << what;
    const auto deviation = StrokeJudge::deviation(judged_, strokes_);
    const double most = (judged_.options.path_tolerance + judged_.options.minimum_feature + off) * edge();
    EXPECT_LT(deviation.stray, most) << what;
    EXPECT_LT(deviation.missed, most) << what;
    EXPECT_EQ(session_.strokes().back().refused, 0) << what;
  }

  /// The place at rest that lies at a place of the world at a time, 0 at the last pose, 1 now, if vertices go straight: of the nearest triangle, whose plane goes on
  /// beyond its sides.
  [[nodiscard]] Vec2 to_rest(Vec2 p, double time) {
    std::vector<Vec3> at = session_.collision_positions();
    for (std::size_t v = 0; v < before_.size(); ++v) at[v] = lerp(before_[v], at[v], time);
    return follow(p, at, session_.body().complex.collision.rest.raw());
  }

 private:
  static double cross_of(Vec2 a, Vec2 b, Vec2 c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }

  [[nodiscard]] Vec2 follow(Vec2 p, const std::vector<Vec3>& from, const std::vector<Vec3>& to) const {
    const CollisionMesh& mesh = session_.body().complex.collision;
    double nearest = -HUGE_VAL;
    Vec2 found;
    for (const CollisionTriangle f : ids<CollisionTriangle>(mesh.face_count())) {
      Vec2 x[3];
      Vec3 y[3];
      for (int k = 0; k < 3; ++k) {
        const std::size_t v = mesh.from(CollisionMesh::corner(f, k)).index();
        x[k] = {from[v].x, from[v].y};
        y[k] = to[v];
      }
      const double area = cross_of(x[0], x[1], x[2]),
                   w[3] = {cross_of(x[1], x[2], p) / area, cross_of(x[2], x[0], p) / area,
                           cross_of(x[0], x[1], p) / area};
      const double inside = std::min({w[0], w[1], w[2]});
      if (inside <= nearest) continue;
      nearest = inside;
      const Vec3 at = w[0] * y[0] + w[1] * y[1] + w[2] * y[2];
      found = {at.x, at.y};
    }
    return found;
  }

  Session session_;
  std::vector<Vec3> before_;  // where vertices were at the last pose
  StrokeBody judged_;
  std::vector<Stroke> strokes_;
};

/// Where a body is that falls from rest, after so many steps: each adds to the velocity first.
Vec2 fallen(Vec2 gravity, int steps) { return 0.5 * steps * (steps + 1) * kStep * kStep * gravity; }

// Falls in its plane, by up to an edge between two poses: the walls are where the blade was in it.
TEST(MovingBlade, CutsABodyThatFallsWhereItWasInIt) {
  Random random(5);
  for (int i = 0; i < 12; ++i) {
    const double heading = random.uniform(0, 2 * M_PI);
    const Vec2 g = random.uniform(0.3, 2) * Vec2{std::cos(heading), std::sin(heading)};
    Moving body(sheet({g.x, g.y, 0}, false));
    Stroke path{{random.uniform(-0.7, 0.7), -0.7},
                {random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3)},
                {random.uniform(-0.7, 0.7), 0.7}};
    for (std::size_t k = 0; k < path.size(); ++k) path[k] = path[k] + fallen(g, 40 * static_cast<int>(k));
    const int poses[] = {2, 5, 10}, between = 40 / poses[i % 3];
    int steps = 0;
    body.cut(path, poses[i % 3], between, [&](Vec2 p, Stroke& at_rest) {
      at_rest.push_back(p - fallen(g, steps));
      steps += between;
    });
    body.expect_cut(0, "set " + std::to_string(i));
  }
}

// Swings on its left side and shears and bends as it does.
TEST(MovingBlade, CutsABodyThatSwingsWhereItWasInIt) {
  Random random(6);
  for (int i = 0; i < 12; ++i) {
    Moving body(sheet({0, random.uniform(-5, 5), 0}, true));
    ASSERT_TRUE(body.session().step(random.index(20)).ok());
    const Stroke path{{random.uniform(-0.3, 0.3), -0.3},
                      {random.uniform(-0.3, 0.3), random.uniform(-0.1, 0.1)},
                      {random.uniform(-0.3, 0.3), 0.3}};
    const int poses[] = {2, 5, 10}, between = 20 / poses[i % 3];
    Vec2 was;
    body.cut(path, poses[i % 3], between, [&](Vec2 p, Stroke& at_rest) {
      for (int k = at_rest.empty() ? kParts : 1; k <= kParts; ++k) {
        const double time = static_cast<double>(k) / kParts;
        at_rest.push_back(body.to_rest(lerp(was, p, time), time));
      }
      was = p;
    });
    body.expect_cut(kGivesWay, "set " + std::to_string(i));
  }
}

}  // namespace
}  // namespace kerf::moving_blade_test
