// Balls thrown at a thin mat, whole and cut, at 0.1 to 10 m/s: none gets through, nothing blows up. KERF_THROWS throws (1000 for
// the full run) from seed KERF_SEED on.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <utility>

#include "kerf/base/random.h"
#include "kerf/session/session.h"

namespace kerf::tool_throws_test {
namespace {

constexpr double kBall = 0.006;  // m, radius

int number(const char* name, int otherwise) {
  const char* text = std::getenv(name);
  return text ? std::atoi(text) : otherwise;
}

/// Distance of a point from a triangle, by the plane where its foot is inside, else by the edges.
double distance(Vec3 p, const std::array<Vec3, 3>& t) {
  const Vec3 n = cross(t[1] - t[0], t[2] - t[0]);
  bool inside = norm(n) > 0;
  double best = HUGE_VAL;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 a = t[k], e = t[(k + 1) % 3] - a;
    inside = inside && dot(cross(e, p - a), n) >= 0;
    const double s = std::clamp(dot(p - a, e) / std::max(dot(e, e), 1e-300), 0.0, 1.0);
    best = std::min(best, norm(p - (a + s * e)));
  }
  return inside ? std::fabs(dot(p - t[0], n)) / norm(n) : best;
}

/// Triangles straight below a point.
int below(Vec3 p, const std::array<Vec3, 3>& t) {
  const auto area = [](Vec3 a, Vec3 b, Vec3 c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); };
  const double whole = area(t[0], t[1], t[2]);
  if (whole == 0) return 0;
  const double u = area(p, t[1], t[2]) / whole, v = area(t[0], p, t[2]) / whole, w = 1 - u - v;
  if (u < 0 || v < 0 || w < 0) return 0;
  return u * t[0].z + v * t[1].z + w * t[2].z < p.z ? 1 : 0;
}

Scene mat_scene(double time_step) {
  Scene scene;
  scene.body.model = "mat";
  scene.body.options.visual_triangles = 2000;
  scene.material.young = 2e5;
  scene.simulation.time_step = time_step;
  scene.simulation.gravity = {};
  for (const Vec3 n : {Vec3{1, 0, 0}, Vec3{-1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, -1, 0}}) {
    SceneFix fix;
    fix.region.shape = SceneRegion::Shape::kHalfSpace;
    fix.region.point = 0.095 * n;
    fix.region.normal = n;
    scene.fixes.push_back(fix);
  }
  SceneRigidTool ball;
  ball.id = "ball";
  ball.kind = SceneToolKind::kSphere;
  ball.radius = kBall;
  ball.position = {0, 0, 0.03};
  ball.max_force = 20;
  scene.tools = {ball};
  return scene;
}

/// A mat, whole or with a slit that opens, but not as wide as the ball.
struct Mat {
  double dt;
  bool cut;
  Session session;
  std::shared_ptr<const SessionSnapshot> start;

  Mat(double step, bool slit, Session made) : dt(step), cut(slit), session(std::move(made)) {
    if (cut) {
      EXPECT_TRUE(session.begin_stroke(SceneFrame::kRest, false).ok());
      for (int i = 0; i <= 8; ++i)
        EXPECT_TRUE(session.move_blade({-0.004 + 0.001 * i, 0.002, 0.01}, {-0.004 + 0.001 * i, 0.002, -0.01}).ok());
      EXPECT_TRUE(session.end_stroke().ok());
    }
    start = session.snapshot();
  }
};

/// Throw `number` of a seed, at the mat as it was in the beginning.
void throw_ball(Mat& mat, int seed, int number) {
  Session& session = mat.session;
  session.restore(mat.start);
  Random random(static_cast<std::uint64_t>(seed) * 7919 + static_cast<std::uint64_t>(number));
  const double dt = mat.dt, speed = std::pow(10, random.uniform(-1, 1));
  const Vec3 target{random.uniform(-0.05, 0.05), random.uniform(-0.05, 0.05), -0.012};
  SceneCommand lead;
  const double time = std::max(dt, 0.042 / speed);
  lead.what = SceneToolMotion{"ball", {{time, target, {}}}};
  ASSERT_TRUE(session.apply(lead).ok());
  const std::string where = testing::PrintToString(seed) + "/" + testing::PrintToString(number) +
                            (mat.cut ? " cut" : " whole") + " dt " + testing::PrintToString(dt) + " speed " +
                            testing::PrintToString(speed);
  const int steps = static_cast<int>(time / dt) + static_cast<int>(0.2 / dt) + 1;
  double most = 0;  // J, of motion
  for (int k = 0; k < steps; ++k) {
    const auto stepped = session.step();
    ASSERT_TRUE(stepped.ok()) << where << ": " << stepped.error().message;
    most = std::max(most, stepped->mechanics.kinetic_energy);
    for (const Vec3 v : session.node_velocities()) ASSERT_TRUE(is_finite(v)) << where;
  }
  // As if the whole mat, 0.12 kg, flew at twice the ball's speed; stretched, it snaps back at a metre a second or two.
  EXPECT_LT(most, 0.5 * 0.12 * 4 * std::max(speed * speed, 1.0)) << where;
  const Vec3 ball = session.tools()[0].place.position;
  const std::vector<Vec3>& x = session.collision_positions();
  const CollisionMesh& mesh = session.body().complex.collision;
  double nearest = HUGE_VAL;
  std::array<int, 2> under{};  // a millimetre to either side: straight below a ball there may be the gap of the slit
  for (const CollisionTriangle f : ids<CollisionTriangle>(mesh.face_count())) {
    std::array<Vec3, 3> t;
    for (int c = 0; c < 3; ++c) t[static_cast<std::size_t>(c)] = x[mesh.origin[CollisionMesh::corner(f, c)].index()];
    nearest = std::min(nearest, distance(ball, t));
    under[0] += below(ball + Vec3{0, 1e-3, 0}, t);
    under[1] += below(ball - Vec3{0, 1e-3, 0}, t);
  }
  EXPECT_TRUE(under[0] % 2 == 1 || under[1] % 2 == 1) << where << ": it is still above the mat";
  EXPECT_GT(nearest, 0.9 * kBall) << where;
}

TEST(ToolThrows, NoneGetsThrough) {
  const int throws = number("KERF_THROWS", 10), seed = number("KERF_SEED", 1);
  for (const double dt : {0.002, 0.0167})
    for (const bool cut : {false, true}) {
      auto made = Session::create(mat_scene(dt));
      ASSERT_TRUE(made.ok()) << made.error().message;
      Mat mat(dt, cut, std::move(*made));
      for (int i = 0; i < (throws + 3) / 4 && !HasFatalFailure(); ++i) throw_ball(mat, seed, i);
    }
}

TEST(ToolThrows, ABallOverTheGapOfTheSlitIsAboveTheMat) {
  auto made = Session::create(mat_scene(0.0167));
  ASSERT_TRUE(made.ok()) << made.error().message;
  Mat mat(0.0167, true, std::move(*made));
  throw_ball(mat, 31337, 57);
}

/// Balls that the mat let through while it was pushed off tools no faster than off itself.
TEST(ToolThrows, ThoseThatOnceGotThroughDoNot) {
  auto made = Session::create(mat_scene(0.0167));
  ASSERT_TRUE(made.ok()) << made.error().message;
  Mat mat(0.0167, false, std::move(*made));
  for (const int i : {15, 55, 65, 69, 100}) throw_ball(mat, 90210, i);
  throw_ball(mat, 271828, 14);
}

}  // namespace
}  // namespace kerf::tool_throws_test
