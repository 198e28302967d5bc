// The haptic channel with a session behind it: a device whose motion is simulated presses a tool onto a body.
#include "kerf/session/haptics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace kerf::haptics_test {
namespace {

/// A slab held from below, a ball over it.
Session slab_with_ball(double time_step, double stiffness) {
  Scene scene;
  scene.body.model = "steak";
  scene.body.options.visual_triangles = 0;
  scene.material.young = 2e4;
  scene.simulation.time_step = time_step;
  scene.simulation.gravity = {};
  SceneFix fix;
  fix.region.shape = SceneRegion::Shape::kHalfSpace;
  fix.region.point = {0, 0, -0.005};
  fix.region.normal = {0, 0, -1};
  scene.fixes = {fix};
  SceneRigidTool ball;
  ball.id = "ball";
  ball.kind = SceneToolKind::kSphere;
  ball.radius = 0.008;
  ball.position = {0, 0, 0.025};
  ball.max_force = 20;
  ball.stiffness = stiffness;
  scene.tools = {ball};
  auto session = Session::create(scene);
  EXPECT_TRUE(session.ok()) << (session.ok() ? "" : session.error().message);
  return std::move(session).value();
}

struct Outcome {
  double force = 0, speed = 0, fastest = 0, lowest = 1;
  double energy = 0;  ///< J that the channel gave the device in all, less what it took
  double most = 0;    ///< J, the highest that ever was
};

/// A device (kg) on a hand of 100 N/m that wants to be 8 mm deep. One step of simulation every `period` seconds, the
/// servo every millisecond; what the simulation publishes is a step old when the servo gets it.
Outcome press(double period, double stiffness, double mass = 0.1) {
  Session session = slab_with_ball(period, stiffness);
  HapticChannel channel;
  HapticServo servo(channel);
  constexpr double tick = 1e-3, hand = 100;
  const double hand_damping = 0.16 * std::sqrt(hand * mass);
  RigidPlace device{{0, 0, 0.025}, {}};
  double velocity = 0, now = 0, next_step = 0;
  Outcome out;
  const double wanted = 0.010, end = mass > 0.2 ? 6 : 3;
  while (now < end) {
    if (now >= next_step - 1e-9) {
      EXPECT_TRUE(session.apply(tool_to("ball", device, period)).ok());
      EXPECT_TRUE(session.step(1).ok());
      publish_haptics(session, 0, now, channel);
      next_step += period;
    }
    const Wrench w = servo.wrench(device, now);
    EXPECT_TRUE(is_finite(w.force) && is_finite(w.torque));
    const double force = w.force.z + hand * (wanted - device.position.z) - hand_damping * velocity;
    velocity += tick * force / mass;
    device.position.z += tick * velocity;
    out.energy += tick * velocity * w.force.z;
    out.most = std::max(out.most, out.energy);
    out.fastest = std::max(out.fastest, std::fabs(velocity));
    out.lowest = std::min(out.lowest, device.position.z);
    if (now > end - 0.5) {
      out.speed = std::max(out.speed, std::fabs(velocity));
      out.force = w.force.z;
    }
    now += tick;
  }
  EXPECT_TRUE(session.validate().ok());
  return out;
}

TEST(Haptics, ADeviceComesToRestOnTissue) {
  struct Row {
    double period, stiffness;
  };
  for (const Row row : {Row{0.001, 2000}, Row{0.002, 2000}, Row{0.004, 2000}, Row{0.0167, 500}, Row{0.0167, 1000}}) {
    const double period = row.period;
    const Outcome o = press(period, row.stiffness);
    EXPECT_GT(o.force, 0.1) << period << ": it feels the slab";
    EXPECT_LT(o.speed, 0.01) << period << ": and does not buzz";
    EXPECT_LT(o.fastest, 0.6) << period;  // a free fall of the hand's spring would reach sqrt(k/m) 15 mm = 0.47 m/s
    EXPECT_LT(o.energy, 1e-4) << period << ": the channel gives no energy";
  }
}

/// Whatever the tool's coupling, the step and the device: the device comes to rest, and is never given more than it gave.
TEST(Haptics, NoDeviceIsGivenEnergy) {
  struct Row {
    double period;
    std::vector<double> masses, stiffnesses;
  };
  for (const Row& row : {Row{0.001, {0.05}, {100}}, Row{0.004, {0.1}, {100, 1000}}, Row{0.0083, {0.05, 0.5}, {500}},
                         Row{0.0167, {0.05, 0.1, 0.5}, {100, 250, 500, 1000, 2000}}})
    for (const double mass : row.masses)
      for (const double stiffness : row.stiffnesses) {
        const Outcome o = press(row.period, stiffness, mass);
        const std::string where = testing::PrintToString(row.period) + " s, " + testing::PrintToString(mass) + " kg, " +
                                  testing::PrintToString(stiffness) + " N/m";
        EXPECT_LT(o.most, 2e-4) << where << ": J at any time; the device comes with 8 mJ";
        EXPECT_LT(o.energy, 0) << where << ": J in the end";
        EXPECT_LT(o.speed, 0.01) << where << ": and at rest";
        // The hand's spring and the coupling in series with what the slab gives way: the force does not depend on the step.
        EXPECT_GT(o.force, 0.3) << where;
        EXPECT_LT(o.force, 0.7) << where;
      }
}

/// A spring that grows under a hand gives what it was given, no more; a hand that holds still feels all of it.
TEST(Haptics, WhatWasNotPaidForIsNotGiven) {
  HapticChannel channel;
  HapticServo servo(channel);
  HapticModel model;
  model.stiffness = 1000;
  model.turning_stiffness = 1;
  model.plane_count = 1;
  model.planes[0] = {{}, {0, 0, -1}, 0, 1000};
  channel.write(model);
  double now = 0, z = 0, given = 0;
  Wrench w = servo.wrench({{0, 0, z}, {}}, now);
  const auto move = [&](double speed, int ticks) {
    for (int i = 0; i < ticks; ++i) {
      const double way = 1e-3 * speed;
      given += w.force.z * way;
      z += way;
      w = servo.wrench({{0, 0, z}, {}}, now += 1e-3);
    }
  };
  move(-0.1, 20);
  EXPECT_NEAR(w.force.z, 1, 1e-9) << "two springs of 1000 N/m in series, 2 mm";
  const double paid = -given;
  EXPECT_NEAR(paid, 0.5 * 500 * 0.002 * 0.002, 0.06e-3);
  model.planes[0].depth = 0.003;  // the tissue swells
  model.time = now;
  channel.write(model);
  move(0, 1);
  EXPECT_NEAR(w.force.z, 2.5, 1e-9) << "felt at once by a hand at rest";
  move(0.2, 150);
  EXPECT_EQ(w.force.z, 0) << "out of it";
  EXPECT_LT(given, 0.1e-3) << "J";
  EXPECT_GT(given, -paid) << "but something comes back";
}

TEST(Haptics, AStaleModelLetsGo) {
  HapticChannel channel;
  HapticServo servo(channel);
  const RigidPlace deep{{0, 0, -0.002}, {}};
  EXPECT_EQ(norm(servo.wrench(deep, 0).force), 0) << "before the first model";
  HapticModel model;
  model.time = 1;
  model.stiffness = 1000;
  model.turning_stiffness = 1;
  model.plane_count = 1;
  model.planes[0] = {{}, {0, 0, -1}, 0, 1000};
  channel.write(model);
  const double full = servo.wrench(deep, 1.0).force.z;
  EXPECT_NEAR(full, 1, 1e-9);
  EXPECT_NEAR(servo.wrench(deep, 1.049).force.z, full, 1e-12);
  EXPECT_NEAR(servo.wrench(deep, 1.075).force.z, full / 2, 1e-9);
  EXPECT_EQ(norm(servo.wrench(deep, 1.101).force), 0);
  // A new one is faded in over its period.
  model.time = 2;
  model.period = 0.010;
  model.planes[0].depth = 0.002;
  channel.write(model);
  const double start = servo.wrench(deep, 2.0).force.z, half = servo.wrench(deep, 2.005).force.z,
               all = servo.wrench(deep, 2.010).force.z;
  EXPECT_NEAR(start, 1, 1e-9);
  EXPECT_NEAR(all, 2, 1e-9);
  EXPECT_NEAR(half, 1.5, 1e-9);
  EXPECT_EQ(norm(servo.wrench({{NAN, 0, 0}, {}}, 2.01).force), 0);
}

}  // namespace
}  // namespace kerf::haptics_test
