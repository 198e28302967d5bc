// Friction of bodies that are light for their stiffness: contacts could hold them with thousands of times their weight, and must not.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "kerf/session/session.h"
#include "session/make_session.h"

namespace kerf::thin_friction_test {
namespace {

using test::make;

constexpr double kFriction = 0.3, kWeight = 9.81 * 0.0144;  // N, of 200 x 24 x 3 mm

/// A strip of 14 g and 3 mm on a plane that is tilted to `slope` about y, by turning gravity instead; its middle is `height` above the plane.
Scene strip_on_slope(double time_step, double slope, double height, double young) {
  Scene scene;
  scene.body.model = "strip";
  scene.body.options.visual_triangles = 0;
  scene.body.position = {0, 0, height};
  scene.material.young = young;
  scene.material.damping_mass = 0;
  scene.simulation.time_step = time_step;
  const double g = 9.81 / std::sqrt(1 + slope * slope);
  scene.simulation.gravity = {slope * g, 0, -g};
  SceneObstacle ground;
  ground.shape = SceneShape::kPlane;
  ground.friction = kFriction;
  scene.obstacles = {ground};
  return scene;
}
double mean_x(Session& session) {
  double sum = 0;
  for (const Vec3 p : session.collision_positions()) sum += p.x;
  return sum / static_cast<double>(session.collision_positions().size());
}

// Contacts that had just closed held with k times their overlap, a hundred times what was left of it a pass later, and so high a norm of the residual ended the
// passes there: at 5 ms it stuck, 0.3 mm on.
TEST(ThinFriction, AStripSlidesDownASlopeAsABlockDoes) {
  for (const double dt : {0.002, 0.005, 0.0167})
    for (const double above :
         {0.0, -1e-7, -1e-5, 1e-4, 4.9e-4, 1.5e-3})  // in the plane at the start, on it, falls on it
      for (const double young : {1e4, 3e5}) {
        constexpr double kSlope = 0.9;
        Session session = make(strip_on_slope(dt, kSlope, 0.0015 + above, young));
        const double from = mean_x(session), g = 9.81 / std::sqrt(1 + kSlope * kSlope);
        const int steps = static_cast<int>(std::lround(0.4 / dt));
        ASSERT_TRUE(session.step(steps).ok());
        // Steps are implicit: n of them go n (n + 1) / 2 h^2 a far. What falls slides freely until it is down.
        const double squares = 0.5 * steps * (steps + 1) * dt * dt, right = squares * g * (kSlope - kFriction),
                     falling = std::sqrt(2 * std::max(0.0, above) / g) + 2 * dt;
        EXPECT_GT(mean_x(session) - from, 0.985 * right) << dt << " " << above << " " << young;
        EXPECT_LT(mean_x(session) - from, 1.005 * right + 0.4 * falling * g * kFriction)
            << dt << " " << above << " " << young;
      }
}

TEST(ThinFriction, AStripHoldsOnASlopeBelowTheCone) {
  for (const double dt : {0.002, 0.0167})
    for (const double above : {0.0, -1e-5, 1e-4}) {
      Session session = make(strip_on_slope(dt, 0.2, 0.0015 + above, 3e5));
      ASSERT_TRUE(session.step(static_cast<int>(std::lround(0.5 / dt))).ok());
      const double from = mean_x(session);
      ASSERT_TRUE(session.step(static_cast<int>(std::lround(0.5 / dt))).ok());
      EXPECT_LT(std::fabs(mean_x(session) - from), 1e-6) << dt << " " << above;
    }
}

// A grasp that goes on asks for the whole way of each step. Measured by that, the solve left friction undone: 0.98 N at 5 ms, and at 16.7 ms 0.43 times what pressed.
TEST(ThinFriction, AStripDrawnOverAPlanePullsWithFrictionTimesItsWeight) {
  for (const double dt : {0.002, 0.005, 0.0167}) {
    Session session = make(strip_on_slope(dt, 0, 0.0015, 3e5));
    ASSERT_TRUE(session.step(static_cast<int>(std::lround(0.3 / dt))).ok());
    std::vector<CollisionVertex> held;
    for (const CollisionVertex v : ids<CollisionVertex>(session.collision_positions().size()))
      if (session.collision_positions()[v.index()].x > 0.095) held.push_back(v);
    ASSERT_TRUE(session.grasp("end", held).ok());
    SceneCommand command;
    SceneMove move;
    move.id = "end";
    move.by = Vec3{0.06, 0, 0};
    move.over = 0.6;
    command.what = move;
    ASSERT_TRUE(session.apply(command).ok());
    double pull = 0, push = 0, drag = 0;
    int steps = 0;
    for (int i = 0; i < static_cast<int>(std::lround(0.6 / dt)); ++i) {
      ASSERT_TRUE(session.step().ok());
      if (i * dt < 0.2) continue;
      pull += session.grasp_force("end").x;
      for (const Session::ContactState& c : session.contacts()) push += dot(c.force, c.normal), drag -= c.force.x;
      ++steps;
    }
    EXPECT_NEAR(pull / steps, kFriction * kWeight, 0.04 * kFriction * kWeight)
        << dt;  // the grasp carries a little of it
    EXPECT_NEAR(drag / push, kFriction, 0.003) << dt;
  }
}

// Where next to nothing presses, springs as stiff as the contact slip after nanometres, and passes go on about who holds: 2.6 of them a frame and 12.3 iterations instead of 2.1 and 10.1.
TEST(ThinFriction, ASteakThatIsCutOnItsBoardIsNoMatterOfManyPasses) {
  Scene scene;
  scene.body.model = "steak";
  scene.body.options.visual_triangles = 0;
  scene.simulation.time_step = 0.001;
  SceneObstacle board;
  board.shape = SceneShape::kPlane;
  board.position = {0, 0, -0.0125};
  scene.obstacles = {board};
  SceneFix& held = scene.fixes.emplace_back();
  held.region.shape = SceneRegion::Shape::kHalfSpace;
  held.region.point = {-0.08, 0, 0};
  held.region.normal = {-1, 0, 0};
  Session session = make(scene);
  ASSERT_TRUE(session.step(300).ok());
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kWorld, true).ok());
  int passes = 0, iterations = 0;
  constexpr int kFrames = 400;
  for (int i = 0; i < kFrames; ++i) {
    const Vec3 p{0.02, -0.1 + 0.2 * i / kFrames, 0}, up{0, 0, 0.1};
    ASSERT_TRUE(session.move_blade(p + up, p - up).ok());
    const auto step = session.step();
    ASSERT_TRUE(step.ok());
    passes += step->mechanics.passes;
    iterations += step->mechanics.iterations;
  }
  EXPECT_LT(passes, 2.4 * kFrames);
  EXPECT_LT(iterations, 11.2 * kFrames);
}

}  // namespace
}  // namespace kerf::thin_friction_test
