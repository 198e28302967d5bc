// The haptic channel with a session behind it: a device whose motion is simulated presses a tool onto a body.
#include "kerf/session/haptics.h"

#include <gtest/gtest.h>

#include <cmath>

namespace kerf {
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
};

/// A device of 0.1 kg on a hand of 100 N/m that wants to be 8 mm deep. One step of simulation every `period` seconds, the
/// servo every millisecond; what the simulation publishes is a step old when the servo gets it.
Outcome press(double period, double stiffness) {
  Session session = slab_with_ball(period, stiffness);
  HapticChannel channel;
  HapticServo servo(channel);
  constexpr double tick = 1e-3, mass = 0.1, hand = 100, hand_damping = 0.5;
  RigidPlace device{{0, 0, 0.025}, {}};
  double velocity = 0, now = 0, next_step = 0;
  Outcome out;
  const double wanted = 0.010, end = 3;
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
    double period, stiffness, energy;
  };
  // At 60 steps a second the coupling must be soft, and the first touch gives a little energy that is lost again.
  for (const Row row : {Row{0.001, 2000, 1e-4}, Row{0.002, 2000, 1e-4}, Row{0.004, 2000, 1e-4}, Row{0.0167, 250, 0.02}}) {
    const double period = row.period;
    const Outcome o = press(period, row.stiffness);
    EXPECT_GT(o.force, 0.1) << period << ": it feels the slab";
    EXPECT_LT(o.speed, 0.01) << period << ": and does not buzz";
    EXPECT_LT(o.fastest, 0.6) << period;  // a free fall of the hand's spring would reach sqrt(k/m) 15 mm = 0.47 m/s
    EXPECT_LT(o.energy, row.energy) << period << ": the channel gives no energy";
  }
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
  const double start = servo.wrench(deep, 2.0).force.z, half = servo.wrench(deep, 2.005).force.z, all = servo.wrench(deep, 2.010).force.z;
  EXPECT_NEAR(start, 1, 1e-9);
  EXPECT_NEAR(all, 2, 1e-9);
  EXPECT_NEAR(half, 1.5, 1e-9);
  EXPECT_EQ(norm(servo.wrench({{NAN, 0, 0}, {}}, 2.01).force), 0);
}

}  // namespace
}  // namespace kerf
