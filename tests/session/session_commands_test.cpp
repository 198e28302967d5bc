// Commands at awkward times and in awkward places.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kerf/session/session.h"

namespace kerf::session_commands_test {
namespace {

Scene sheet() {
  Scene scene;
  scene.name = "sheet";
  scene.body.model = "sheet";
  scene.body.options.visual_triangles = 1664;
  scene.simulation.gravity = {0, 0, -1};
  return scene;
}

SceneCommand blade(double at, double over, double x) {
  SceneBlade b;
  b.frame = SceneFrame::kRest;
  b.poses = {{0, {x, -0.6, 1}, {x, -0.6, -1}}, {over, {x, 0.6, 1}, {x, 0.6, -1}}};
  return {at, b};
}

TEST(SessionCommands, StrokesShorterThanATimeStepAllCut) {
  Scene scene = sheet();
  scene.simulation.time_step = 0.1;
  scene.commands = {blade(0.01, 0.03, -0.2), blade(0.05, 0.02, 0.0), blade(0.08, 0.01, 0.2)};
  auto session = Session::create(scene);
  ASSERT_TRUE(session.ok());
  ASSERT_TRUE(session->step(3).ok());
  EXPECT_EQ(session->counts().pieces, 4);
  EXPECT_EQ(session->undo_depth(), 3);
}

TEST(SessionCommands, TheLastBitOfAStrokeIsCutBeforeTheNextBegins) {
  Scene scene = sheet();
  scene.simulation.time_step = 0.01;
  scene.commands = {blade(0.0, 0.0555, -0.2), blade(0.0556, 0.05, 0.2), {0.11, SceneUndo{2}}};
  auto session = Session::create(scene);
  ASSERT_TRUE(session.ok());
  ASSERT_TRUE(session->step(9).ok());
  ASSERT_EQ(session->strokes().size(), 2u);
  EXPECT_TRUE(session->strokes()[0].finished);
  EXPECT_EQ(session->strokes()[0].after.pieces, 2);
  ASSERT_TRUE(session->step(6).ok());
  EXPECT_EQ(session->counts().pieces, 1);
}

TEST(SessionCommands, AnUndoBeyondTheFirstStrokeIsNotedAndTheRunGoesOn) {
  Scene scene = sheet();
  scene.file = "scene.toml";
  scene.simulation.time_step = 0.01;
  scene.commands = {blade(0.0, 0.05, 0.7),
                    {0.06, SceneUndo{1}, 12},
                    blade(0.07, 0.05, 0.1),
                    {0.13, SceneRedo{1}, 20}};  // the first misses
  auto session = Session::create(scene);
  ASSERT_TRUE(session.ok());
  const Status done = session->step(15);
  EXPECT_TRUE(done.ok()) << done.error().message;
  EXPECT_EQ(session->counts().pieces, 2);
  EXPECT_THAT(session->notes(), testing::IsSupersetOf({"scene.toml:12: there was no stroke left to undo",
                                                       "scene.toml:20: there was no stroke left to redo"}));
}

TEST(SessionCommands, ABladeMayTurnOverBetweenTwoPoses) {
  Scene scene = sheet();
  scene.simulation.time_step = 0.01;
  SceneBlade b;
  b.frame = SceneFrame::kRest;
  b.poses = {{0, {0, -0.3, -1}, {0, -0.3, 1}}, {0.1, {0, 0.3, 1}, {0, 0.3, -1}}};  // half-way it has no length
  scene.commands = {{0, b}};
  auto session = Session::create(scene);
  ASSERT_TRUE(session.ok());
  const Status done = session->step(15);
  EXPECT_TRUE(done.ok()) << done.error().message;
  EXPECT_TRUE(session->validate().ok());
}

TEST(SessionCommands, UnfixFreesWhatFixHeld) {
  Scene scene = sheet();
  scene.material.damping_mass = 0;
  scene.simulation.tolerance = 1e-8;
  auto session = Session::create(scene);
  ASSERT_TRUE(session.ok());
  SceneRegion tiny;  // holds no node, only a collision vertex: the nodes of its cell are fixed
  tiny.shape = SceneRegion::Shape::kSphere;
  tiny.center = session->collision_positions()[30];
  tiny.radius = 1e-4;
  ASSERT_TRUE(session->apply({0, SceneFixCommand{tiny}}).ok());
  ASSERT_TRUE(session->step(1).ok());
  EXPECT_GT(norm(session->support_force()), 0);
  ASSERT_TRUE(session->apply({0, SceneUnfix{tiny}}).ok());
  ASSERT_TRUE(session->step(1).ok());
  EXPECT_EQ(norm(session->support_force()), 0);
}

TEST(SessionCommands, ABladeWithoutPosesIsRefused) {
  Scene scene = sheet();
  scene.commands = {{0, SceneBlade{}}};
  const auto session = Session::create(scene);
  ASSERT_FALSE(session.ok());
  EXPECT_NE(session.error().message.find("no poses"), std::string::npos);
}

}  // namespace
}  // namespace kerf::session_commands_test
