// What resists an edge that cuts: statics say what a knife feels, and what it leaves behind.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "kerf/session/session.h"
#include "session/make_session.h"

namespace kerf::edge_resistance_test {
namespace {

using test::make;

#ifdef __SANITIZE_ADDRESS__
const std::vector<double> kSteps{0.0167};
#else
const std::vector<double> kSteps{0.001, 0.005, 0.0167};
#endif

const double kThird = 2 * std::numbers::pi / (3 * std::sqrt(3.0));
/// The edge lies along y and faces down: x, y and z of the tool are -z, -x and y of the world.
const Vec3 kFacingDown{-kThird, kThird, kThird};

/// A strip on a board, and a knife above it whose edge is longer than the strip is wide.
Scene board_scene(double time_step, double resistance) {
  Scene scene;
  scene.body.model = "strip";
  scene.material.young = 1e5;
  scene.material.damping_mass = 2;
  scene.cut.resistance = resistance;
  scene.simulation.time_step = time_step;
  SceneObstacle board;
  board.name = "board";
  board.shape = SceneShape::kBox;
  board.size = {0.30, 0.10, 0.02};
  board.position = {0, 0, -0.0115};
  scene.obstacles = {board};
  SceneRigidTool knife;
  knife.id = "knife";
  knife.kind = SceneToolKind::kScalpel;
  knife.position = {0.005, -0.03, 0.010};
  knife.rotation = kFacingDown;
  knife.tip = 0.06;
  knife.width = 0.015;
  knife.thickness = 0.001;
  scene.tools = {knife};
  return scene;
}

int steps(const Session& session, double seconds) { return static_cast<int>(std::ceil(seconds / session.time_step() - 1e-9)); }

/// Leads the knife to a height and waits.
void lead(Session& session, double z, double over, double wait) {
  SceneCommand command;
  command.what = SceneToolMotion{"knife", {{over, {0.005, -0.03, z}, kFacingDown}}};
  ASSERT_TRUE(session.apply(command).ok());
  ASSERT_TRUE(session.step(steps(session, over + wait)).ok());
}

double board_force(const Session& session) {
  double sum = 0;
  for (const Session::ContactState& c : session.contacts())
    if (c.obstacle >= 0) sum += c.force.z;
  return sum;
}

/// The knife is lifted straight out of what it has cut, all of it or in part: it takes nothing along.
TEST(EdgeResistance, AKnifeThatIsLiftedLeavesAllOnTheBoard) {
  for (const double resistance : {10.0, 30.0})
    for (const double dt : kSteps) {
      Session session = make(board_scene(dt, resistance));
      ASSERT_TRUE(session.step(steps(session, 0.3)).ok());
      const double weight = board_force(session);
      EXPECT_GT(weight, 0.1);
      lead(session, 0.0017, 0.3, 0);
      lead(session, -0.0014, 1, 0.3);
      EXPECT_TRUE(session.in_stroke()) << resistance << " " << dt;
      lead(session, 0.020, 0.4, 0.5);
      EXPECT_FALSE(session.in_stroke()) << resistance << " " << dt;
      EXPECT_NEAR(board_force(session), weight, 0.01 * weight) << resistance << " " << dt;
      for (const Vec3& x : session.collision_positions()) ASSERT_LT(x.z, 0.0005) << resistance << " " << dt;
      EXPECT_NEAR(norm(session.tools()[0].coupling_force), 0, 1e-4);
      EXPECT_TRUE(session.validate().ok());
    }
}

/// A knife that stands still in the material feels a still force: the board carries it and the strip, the coupling is in balance with it, and it is the
/// same for every step, which is made as one.
TEST(EdgeResistance, AStillKnifeFeelsAStillForce) {
  std::vector<double> felt;
  for (const double dt : kSteps) {
    Session session = make(board_scene(dt, 30));
    ASSERT_TRUE(session.step(steps(session, 0.3)).ok());
    const double weight = board_force(session);
    lead(session, 0.0017, 0.3, 0);
    lead(session, -0.0014, 1, 0.5);
    ASSERT_TRUE(session.in_stroke());
    const Vec3 first = session.tools()[0].coupling_force;
    EXPECT_LT(first.z, -0.3) << "it presses down";
    EXPECT_GE(first.z, -30 * 0.03);
    for (int i = 0; i < steps(session, 0.2); ++i) {
      const auto step = session.step();
      ASSERT_TRUE(step.ok());
      EXPECT_EQ(step.value().parts, 1) << dt;
      const Session::ToolState tool = session.tools()[0];
      EXPECT_LT(norm(tool.coupling_force - first), 0.002) << dt;
      EXPECT_LT(norm(tool.place.velocity), 1e-4) << dt << ": it stands still";
      EXPECT_NEAR(board_force(session), weight - tool.coupling_force.z, 0.005) << dt;
    }
    felt.push_back(first.z);
  }
  for (const double f : felt) EXPECT_NEAR(f, felt[0], 0.01);
}

/// Led on, it feels the resistance and no more; what it feels is what the material gets, in every step.
TEST(EdgeResistance, WhatTheKnifeFeelsTheBoardGets) {
  for (const double dt : kSteps) {
    Session session = make(board_scene(dt, 10));
    ASSERT_TRUE(session.step(steps(session, 0.3)).ok());
    const double weight = board_force(session);
    lead(session, 0.0017, 0.3, 0);
    lead(session, 0.0005, 0.4, 0);
    ASSERT_TRUE(session.in_stroke());
    SceneCommand command;
    command.what = SceneToolMotion{"knife", {{0.3, {0.005, -0.03, -0.0005}, kFacingDown}}};
    ASSERT_TRUE(session.apply(command).ok());
    for (int i = 0; i < steps(session, 0.3); ++i) {
      ASSERT_TRUE(session.step().ok());
      if (session.contacts().empty()) continue;  // something was cut
      const double press = -session.tools()[0].coupling_force.z;
      EXPECT_GT(press, 0) << dt;
      EXPECT_LE(press, 10 * 0.03) << dt;
      EXPECT_NEAR(board_force(session), weight + press, 0.03) << dt;
    }
  }
}

}  // namespace
}  // namespace kerf::edge_resistance_test
