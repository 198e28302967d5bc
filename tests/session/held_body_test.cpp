// Contact holds the whole body, not its collision vertices alone: where the lattice is finer than the collision mesh, or has several layers.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "kerf/session/session.h"
#include "session/make_session.h"

namespace kerf::held_body_test {
namespace {

using test::make;

constexpr double kHalf = 0.05;  // m: half the sheet's thickness
constexpr double kYoung = 5000;

/// The sheet of 1 x 1 x 0.1 m with 104 collision triangles, each of 0.014 square metres, and cells of this many along its edges and across.
Scene sheet(std::array<int, 3> cells) {
  Scene scene;
  scene.body.model = "sheet";
  scene.body.options.visual_triangles = 0;
  scene.body.options.collision_triangles = 104;
  scene.lattice.origin = Vec3{-0.5, -0.5, -kHalf};
  scene.lattice.cells = cells;
  scene.lattice.cell_size = Vec3{1.0 / cells[0], 1.0 / cells[1], 2 * kHalf / cells[2]};
  scene.material.young = kYoung;
  scene.material.damping_mass = 5;
  scene.simulation.time_step = 0.01;
  scene.simulation.gravity = {};
  return scene;
}

void run(Session& session, double seconds) {
  for (int i = 0; i < static_cast<int>(std::ceil(seconds / session.time_step())); ++i) {
    const auto done = session.step();
    ASSERT_TRUE(done.ok()) << (done.ok() ? "" : done.error().message);
  }
}

double fastest(const Session& session) {
  double most = 0;
  for (const Vec3& v : session.node_velocities()) most = std::max(most, norm(v));
  return most;
}

/// N that press on an obstacle.
double pressing_on(const Session& session, std::int32_t obstacle) {
  double sum = 0;
  for (const Session::ContactState& c : session.contacts())
    if (c.obstacle == obstacle) sum += c.normal_force;
  return sum;
}

SceneObstacle plate_above(double strain) {
  SceneObstacle top;
  top.shape = SceneShape::kBox;
  top.size = {1.5, 1.5, 0.2};
  top.position = {0, 0, kHalf + 0.1};
  top.moves = {{0, {0, 0, kHalf + 0.1}, {}}, {0.4, {0, 0, kHalf + 0.1 - strain * 2 * kHalf}, {}}};
  return top;
}

/// Between plates without friction the stress is the same everywhere, and the force is that of a rod, E A e, whatever the meshes.
void expect_a_rod(std::array<int, 3> cells) {
  constexpr double kStrain = 0.1, kTruth = kYoung * kStrain;  // N on 1 m2
  Scene scene = sheet(cells);
  scene.contact.friction = 0;
  scene.contact.stiffness = 300;  // ten times the default: what contacts give way by is not asked here
  SceneObstacle floor;
  floor.position = {0, 0, -kHalf};
  scene.obstacles = {floor, plate_above(kStrain)};
  Session session = make(scene);
  run(session, 1.0);
  EXPECT_NEAR(pressing_on(session, 0), kTruth, 0.02 * kTruth) << cells[0] << " " << cells[2];
  EXPECT_NEAR(pressing_on(session, 1), kTruth, 0.02 * kTruth) << cells[0] << " " << cells[2];
  double deepest = 0;
  for (const Vec3& x : session.visual_positions())
    deepest = std::max({deepest, -kHalf - x.z, x.z - kHalf + kStrain * 2 * kHalf});
  EXPECT_LT(deepest, 0.05 * kHalf) << cells[0] << " " << cells[2];
  EXPECT_LT(fastest(session), 2e-3) << cells[0] << " " << cells[2];
}

// With contacts at collision vertices alone it was 98 N for 500.
TEST(HeldBody, ASqueezedSheetPressesBackAsARod) { expect_a_rod({18, 18, 1}); }

TEST(HeldBody, ASqueezedSheetPressesBackAsARodWhateverItsCells) {
  for (const std::array<int, 3> cells : {std::array{9, 9, 2}, {9, 9, 3}, {18, 18, 2}, {27, 27, 1}}) expect_a_rod(cells);
}

// A ball between collision vertices lies on the skin. Nodes were 0.32 half thicknesses deep in it, and 0.22 in the floor.
TEST(HeldBody, ABallPressesTheSkinAwayBetweenCollisionVertices) {
  Scene scene = sheet({27, 27, 2});
  SceneObstacle floor, ball;
  floor.position = {0, 0, -kHalf};
  ball.shape = SceneShape::kSphere;
  ball.radius = 0.08;
  const Vec3 above{0.07, 0.05, kHalf + ball.radius}, pressed = above - Vec3{0, 0, 0.6 * kHalf};
  ball.position = above;
  ball.moves = {{0, above, {}}, {0.3, pressed, {}}};
  scene.obstacles = {floor, ball};
  Session session = make(scene);
  run(session, 1.0);
  double in_ball = 0, in_floor = 0;
  for (const Vec3& x : session.node_positions()) {  // the lattice fills the sheet: its outer nodes are on the skin
    in_ball = std::max(in_ball, ball.radius - norm(x - pressed));
    in_floor = std::max(in_floor, -kHalf - x.z);
  }
  EXPECT_LT(in_ball, 0.06 * kHalf);
  EXPECT_LT(in_floor, 0.05 * kHalf);
  EXPECT_GT(pressing_on(session, 1), 0);
}

void cut_across(Session& session) {
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, false).ok());
  for (const double y : {-0.7, -0.2, 0.1, 0.7})
    ASSERT_TRUE(session.move_blade({-0.11 + 0.03 * y, y, 0.2}, {-0.11 + 0.03 * y, y, -0.2}).ok());
  ASSERT_TRUE(session.end_stroke().ok());
}

// Points follow cuts: after an undo they are what they were, and a session that was restored has the same as one whose cuts they followed.
TEST(HeldBody, PointsFollowCutsUndoAndSnapshots) {
  Scene scene = sheet({18, 18, 2});
  SceneObstacle floor;
  floor.position = {0, 0, -kHalf};
  scene.obstacles = {floor, plate_above(0.02)};
  Session session = make(scene);
  run(session, 0.05);
  const auto uncut = session.snapshot();
  run(session, 0.05);
  const std::uint64_t without = session.hash();
  session.restore(uncut);
  cut_across(session);
  ASSERT_TRUE(session.undo().ok());
  run(session, 0.05);
  EXPECT_EQ(session.hash(), without);
  cut_across(session);
  run(session, 0.05);
  const auto cut = session.snapshot();
  run(session, 0.05);
  const std::uint64_t followed = session.hash();
  session.restore(cut);
  run(session, 0.05);
  EXPECT_EQ(session.hash(), followed);
  EXPECT_EQ(session.counts().pieces, 2);
}

}  // namespace
}  // namespace kerf::held_body_test
