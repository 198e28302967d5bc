// Commands at awkward times and in awkward places.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "session/make_session.h"

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

TEST(SessionCommands, AStrokeMayBeginWhenTheOneBeforeEnds) {
  const double late = 0.14 + 0.002;  // one bit after 0.142
  ASSERT_GT(late, 0.142);
  Scene scene = sheet();
  scene.simulation.time_step = 0.001;
  scene.commands = {blade(0.14, 0.002, -0.2), blade(0.142, 0.05, 0.2)};
  Session session = test::make(scene);
  ASSERT_TRUE(session.step(200).ok());
  EXPECT_EQ(session.counts().pieces, 3);
  EXPECT_EQ(session.undo_depth(), 2);
  scene.commands[1].at = 0.1419;
  const auto overlaps = Session::create(scene);
  ASSERT_FALSE(overlaps.ok());
  EXPECT_NE(overlaps.error().message.find("one blade cuts at a time"), std::string::npos);
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

ScenePunch punch(Vec3 point, double radius) {
  ScenePunch p;
  p.frame = SceneFrame::kRest;
  p.point = point;
  p.radius = radius;
  p.take = true;
  return p;
}

/// Where the sheet has nothing left once a hole of 0.1 is punched there.
SceneFixCommand fix_in_the_hole() {
  SceneFixCommand fix;
  fix.region.shape = SceneRegion::Shape::kSphere;
  fix.region.center = {0.2, 0.2, 0};
  fix.region.radius = 1e-3;
  return fix;
}

TEST(SessionCommands, WhatTheBodyRefusesIsNotedAndTheRunGoesOn) {
  Scene scene = sheet();
  scene.file = "scene.toml";
  scene.simulation.time_step = 0.01;
  SceneGrasp grasp;
  grasp.id = "g";
  grasp.point = {-0.3, 0, 0};
  SceneRemove remove;
  remove.grasp = "g";
  const SceneCommand hole{0, punch({0.2, 0.2, 0}, 0.1), 5}, held{0.01, grasp, 8}, last = blade(0.05, 0.03, -0.2);
  scene.commands = {hole, held, last};
  Session plain = test::make(scene);
  ASSERT_TRUE(plain.step(10).ok());
  scene.commands = {
      hole, held, {0.02, fix_in_the_hole(), 12}, {0.03, punch({-0.2, 0.2, 0}, 1e-5), 16}, {0.04, remove, 20}, last};
  Session session = test::make(scene);
  const Status done = session.step(10);
  ASSERT_TRUE(done.ok()) << done.error().message;
  const auto note = [](const char* begin, const char* end) {
    return testing::Contains(testing::AllOf(testing::StartsWith(begin), testing::EndsWith(end)));
  };
  EXPECT_THAT(session.notes(), note("scene.toml:12: the fix command holds nothing",
                                    "move it onto the body; this command of 0.02 s was skipped"));
  EXPECT_THAT(session.notes(), note("scene.toml:16: punch: too small", "; this command of 0.03 s was skipped"));
  EXPECT_THAT(session.notes(), note("scene.toml:20: the body is in one piece", "; this command of 0.04 s was skipped"));
  EXPECT_EQ(session.counts().pieces, 2) << "the blade after them cuts";
  EXPECT_EQ(session.node_positions(), plain.node_positions()) << "to the bit as if they were not there";
}

TEST(SessionCommands, WhatIsRefusedByHandIsAnError) {
  Session session = test::make(sheet());
  ASSERT_TRUE(session.apply({0, punch({0.2, 0.2, 0}, 0.1)}).ok());
  const std::size_t notes = session.notes().size();
  EXPECT_FALSE(session.apply({0, fix_in_the_hole()}).ok());
  EXPECT_FALSE(session.apply({0, punch({-0.2, 0.2, 0}, 1e-5)}).ok());
  EXPECT_EQ(session.notes().size(), notes);
}

TEST(SessionCommands, WhatCouldNeverBeDoneEndsAStep) {
  Scene scene = sheet();
  SceneMove move;
  move.id = "nobody";
  scene.commands = {{0, move}};
  EXPECT_FALSE(test::make(scene).step(1).ok());
}

TEST(SessionCommands, MaterialsAreThoseThatScenesTake) {
  auto session = Session::create(sheet());
  ASSERT_TRUE(session.ok());
  const Material before = session->material();
  const std::vector<std::pair<std::array<double, 3>, std::string>> wrong{
      {{1e-4, 0.3, 1000}, "young must be at least 0.001"},
      {{1e14, 0.3, 1000}, "young must be at most 1"},
      {{1e5, 0.5, 1000}, "poisson must be at most 0.49"},
      {{1e5, 0.3, 1e-4}, "density must be at least 0.001"}};
  for (const auto& [numbers, why] : wrong) {
    const Status refused = session->set_material(numbers[0], numbers[1], numbers[2]);
    ASSERT_FALSE(refused.ok()) << why;
    EXPECT_THAT(refused.error().message, ::testing::HasSubstr("material: " + why));
    EXPECT_EQ(session->material().young, before.young);
  }
  EXPECT_TRUE(session->set_material(1e-3, 0.49, 1e-3).ok());
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
