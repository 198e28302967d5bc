// A whole step without a cut allocates nothing in steady state: commands, contact, mechanics, surface.
#include <gtest/gtest.h>

#include "kerf/base/parallel.h"
#include "kerf/session/session.h"
#include "support/counted_new.h"

namespace kerf::step_allocation_test {
namespace {

Scene steak() {
  Scene scene;
  scene.name = scene.body.model = "steak";
  scene.simulation.time_step = 0.002;
  SceneFix fix;
  fix.region.shape = SceneRegion::Shape::kHalfSpace;
  fix.region.point = {0, 0.055, 0};
  fix.region.normal = {0, 1, 0};
  scene.fixes.push_back(fix);
  return scene;
}

/// Allocations of `n` steps, surface included, after `warm` others.
long allocations_of(Session& session, int warm, int n) {
  std::vector<Vec3f> positions, normals;
  long before = 0;
  for (int i = 0; i < warm + n; ++i) {
    if (i == warm) before = allocations.load();
    const auto step = session.step();
    EXPECT_TRUE(step.ok());
    session.visual_skin(positions, normals);
    (void)session.collision_positions();
  }
  return allocations.load() - before;
}

Status cut(Session& session) {
  KERF_TRY(session.begin_stroke(SceneFrame::kRest, true));
  for (int i = 0; i <= 6; ++i)
    KERF_TRY(session.move_blade({0.01, -0.1 + 0.02 * i, 0.05}, {0.01, -0.1 + 0.02 * i, -0.05}));
  return session.end_stroke();
}

TEST(StepAllocation, NothingWithoutContact) {
  const ThreadLimit one(1);
  auto session = Session::create(steak());
  ASSERT_TRUE(session.ok()) << session.error().message;
  EXPECT_EQ(allocations_of(*session, 30, 100), 0);
  ASSERT_TRUE(cut(*session).ok());
  EXPECT_EQ(allocations_of(*session, 30, 100), 0) << "after a cut";
}

TEST(StepAllocation, NothingWhileItIsPulled) {
  const ThreadLimit one(1);
  auto session = Session::create(steak());
  ASSERT_TRUE(session.ok());
  SceneCommand command;
  SceneGrasp grasp;
  grasp.id = "g";
  grasp.point = {0.04, -0.06, 0};
  grasp.radius = 0.01;
  command.what = grasp;
  ASSERT_TRUE(session->apply(command).ok());
  SceneMove move;
  move.id = "g";
  move.by = {0.02, 0, 0.02};
  move.over = 0.5;
  command.what = move;
  ASSERT_TRUE(session->apply(command).ok());
  EXPECT_EQ(allocations_of(*session, 30, 200), 0);
}

TEST(StepAllocation, NothingUnderALoad) {
  const ThreadLimit one(1);
  Scene scene = steak();
  SceneLoad& load = scene.loads.emplace_back();
  load.point = {0.04, -0.06, 0.01};
  load.force = {0, 0, -1};
  auto session = Session::create(scene);
  ASSERT_TRUE(session.ok()) << session.error().message;
  EXPECT_EQ(allocations_of(*session, 30, 100), 0);
}

TEST(StepAllocation, NothingAtRestOnAPlane) {
  const ThreadLimit one(1);
  Scene scene = steak();
  SceneObstacle& plane = scene.obstacles.emplace_back();
  plane.shape = SceneShape::kPlane;
  plane.position = {0, 0, -0.0125};
  auto session = Session::create(scene);
  ASSERT_TRUE(session.ok()) << session.error().message;
  ASSERT_TRUE(cut(*session).ok());
  // Coming down, more and more touches; memory for that is got when it is wanted first.
  EXPECT_EQ(allocations_of(*session, 600, 200), 0);
  EXPECT_FALSE(session->contacts().empty());
}

}  // namespace
}  // namespace kerf::step_allocation_test
