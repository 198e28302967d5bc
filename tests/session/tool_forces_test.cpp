// The forces that tools report, against what moves them and against what supports hold.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "kerf/base/rigid_place.h"
#include "kerf/session/session.h"
#include "session/make_session.h"

namespace kerf::tool_forces_test {
namespace {

using test::make;

constexpr double kMass = 0.05, kStiffness = 500, kGyration = 0.02;  // kg, N/m, m

/// A strip along x, 200 x 24 x 3 mm, without weight, held at its left end or at both, and a tool.
Scene strip_and_tool(SceneToolKind kind, Vec3 position, Vec3 rotation, bool both_ends) {
  Scene scene;
  scene.body.model = "strip";
  scene.body.options.visual_triangles = 1000;
  scene.lattice.cells = std::array<int, 3>{50, 8, 1};
  scene.simulation.gravity = {};
  scene.simulation.tolerance = 1e-9;
  scene.material.young = 1e5;
  scene.material.damping_mass = 10;
  for (const double side : {-1.0, 1.0}) {
    if (side > 0 && !both_ends) continue;
    SceneFix fix;
    fix.region.shape = SceneRegion::Shape::kHalfSpace;
    fix.region.point = {0.095 * side, 0, 0};
    fix.region.normal = {side, 0, 0};
    scene.fixes.push_back(fix);
  }
  SceneRigidTool tool;
  tool.id = "tool";
  tool.kind = kind;
  tool.position = position;
  tool.rotation = rotation;
  tool.mass = kMass;
  tool.stiffness = kStiffness;
  tool.max_force = 0;
  scene.tools = {tool};
  return scene;
}

constexpr Vec3 kFacingY{0, 0, std::numbers::pi / 2}, kAlongX{0, std::numbers::pi / 2, 0};

void apply(Session& session, SceneCommand command) {
  const Status done = session.apply(command);
  ASSERT_TRUE(done.ok()) << done.error().message;
}
void lead(Session& session, Vec3 to, Vec3 rotation, double over) {
  SceneCommand command;
  command.what = SceneToolMotion{"tool", {{over, to, rotation}}};
  apply(session, command);
}
void close(Session& session) {
  SceneCommand command;
  command.what = SceneJaws{"tool", true, 0.1};
  apply(session, command);
}

/// A tool on its way, and at rest in the end: what it does first, and where to in how long.
struct Task {
  std::string name;
  Scene scene;
  double closes = 0;  // s that jaws are given to take hold
  Vec3 to, rotation;
  double over = 0.2;
};

std::vector<Task> tasks(double dt) {
  std::vector<Task> out;
  out.push_back({"presses",
                 strip_and_tool(SceneToolKind::kProbe, {0.003, 0.002, 0.006}, {}, true),
                 0,
                 {0.003, 0.002, -0.003},
                 {}});
  out.back().scene.material.young = 1e6;
  out.push_back({"cuts",
                 strip_and_tool(SceneToolKind::kScalpel, {0.003, -0.02, -0.012}, kFacingY, true),
                 0,
                 {0.003, 0.001, -0.012},
                 kFacingY});
  out.back().scene.cut.resistance = 20;
  out.push_back({"pulls",
                 strip_and_tool(SceneToolKind::kGrasper, {0.092, 0, 0}, kAlongX, false),
                 0.3,
                 {0.096, 0.001, 0.004},
                 kAlongX});
  out.back().scene.tools[0].tip = 0.016;
  for (Task& task : out) task.scene.simulation.time_step = dt;
  return out;
}

/// Steps until `end`; the greatest of what `off` returns after each.
template <class Off>
double greatest(Session& session, double end, Off&& off) {
  double most = 0;
  while (session.time() < end - 1e-9) {
    const auto step = session.step();
    EXPECT_TRUE(step.ok()) << step.error().message;
    if (!step.ok()) break;
    most = std::max(most, off());
  }
  return most;
}

/// Mass times acceleration less the force that is reported, less the coupling's own law: N, and N m over the radius of gyration.
struct Balance {
  const Session& session;
  Session::ToolState before = session.tools()[0];
  double operator()() {
    const Session::ToolState now = session.tools()[0];
    const double h = session.time_step(), inertia = kMass * kGyration * kGyration,
                 turning = kStiffness * kGyration * kGyration;
    const Vec3 leads = (1 / h) * (now.pose.position - before.pose.position);
    const Vec3 turns = (1 / h) * turn_of(product(now.pose.axes, transposed(before.pose.axes)));
    const Vec3 spring = kStiffness * (now.pose.position - now.place.position) +
                        2 * std::sqrt(kStiffness * kMass) * (leads - now.place.velocity);
    // Turns are linear in a step: from how it stood when the step began.
    const Vec3 twist = turning * (turn_of(product(now.pose.axes, transposed(before.place.axes))) - h * now.place.spin) +
                       2 * std::sqrt(turning * inertia) * (turns - now.place.spin);
    const Vec3 force = (kMass / h) * (now.place.velocity - before.place.velocity) - spring - now.force;
    const Vec3 torque = (inertia / h) * (now.place.spin - before.place.spin) - twist - now.torque;
    const double coupling = norm(now.coupling_force - spring) + norm(now.coupling_torque - twist) / kGyration;
    before = now;
    return std::max({norm(force), norm(torque) / kGyration, coupling});
  }
};

TEST(ToolForces, AreWhatMovesTheToolInEveryStep) {
  for (const double dt : {0.005, 0.0167})
    for (Task& task : tasks(dt)) {
      SCOPED_TRACE(task.name + " " + std::to_string(dt));
      task.scene.contact.substeps = 1;
      Session session = make(task.scene);
      Balance balance{session};
      double felt = 0;
      const auto off = [&] {
        felt = std::max(felt, norm(session.tools()[0].force));
        return balance();
      };
      if (task.closes > 0) close(session);
      double most = greatest(session, task.closes, off);
      lead(session, task.to, task.rotation, task.over);
      most = std::max(most, greatest(session, task.closes + 0.6, off));
      EXPECT_GT(felt, 0.005);
      EXPECT_LT(most, 1e-4 * felt);
    }
}

TEST(ToolForces, AreMeansOverAStepInParts) {
  // A jump of the pose, followed as fast as the tool may: forces and couplings of all parts together move it.
  Scene scene = strip_and_tool(SceneToolKind::kProbe, {0.003, 0.002, 0.02}, {}, true);
  scene.simulation.time_step = 0.0167;
  scene.simulation.tolerance = 0.01;
  scene.tools[0].max_speed = 1;
  Session session = make(scene);
  lead(session, {0.003, 0.002, -0.006}, {}, 1e-3);
  RigidState before = session.tools()[0].place;
  int parts = 1;
  double felt = 0, off = 0, turned_off = 0;
  for (int i = 0; i < 40; ++i) {
    const auto step = session.step();
    ASSERT_TRUE(step.ok()) << step.error().message;
    parts = std::max(parts, step->parts);
    const Session::ToolState now = session.tools()[0];
    felt = std::max(felt, norm(now.force));
    const double h = session.time_step();
    const Vec3 force = (kMass / h) * (now.place.velocity - before.velocity),
               torque = (kMass * kGyration * kGyration / h) * (now.place.spin - before.spin);
    off = std::max(off, norm(force - now.force - now.coupling_force));
    turned_off = std::max(turned_off, norm(torque - now.torque - now.coupling_torque));
    before = now.place;
  }
  EXPECT_LT(off, 1e-9);
  EXPECT_LT(turned_off, 1e-11);
  EXPECT_GT(parts, 2);
  EXPECT_GT(felt, 0.05);
}

TEST(ToolForces, AtRestTheyAreWhatSupportsHold) {
  for (const double dt : {0.005, 0.0167})
    for (Task& task : tasks(dt)) {
      SCOPED_TRACE(task.name + " " + std::to_string(dt));
      Session session = make(task.scene);
      if (task.closes > 0) close(session);
      greatest(session, task.closes, [] { return 0.0; });
      lead(session, task.to, task.rotation, task.over);
      greatest(session, task.closes + 2.5, [] { return 0.0; });
      const Session::ToolState tool = session.tools()[0];
      const Vec3 held = session.support_force();
      ASSERT_GT(norm(held), 0.01);
      EXPECT_LT(norm(tool.force - held), 0.01 * norm(held) + 1e-4);
      EXPECT_LT(norm(tool.force + tool.coupling_force), 0.01 * norm(held) + 1e-4);
      EXPECT_LT(norm(tool.torque + tool.coupling_torque), (0.01 * norm(held) + 1e-4) * kGyration);
      Vec3 moment;  // of supports about the tool's place
      double scale = 0;
      for (const NodeId n : ids<NodeId>(session.node_positions().size())) {
        const Vec3 arm = session.node_positions()[n.index()] - tool.place.position, force = session.support_force(n);
        moment += cross(arm, force);
        scale += norm(cross(arm, force));
      }
      EXPECT_LT(norm(tool.torque - moment), 0.02 * scale);
    }
}

TEST(ToolForces, TheScoreKnowsWhatJawsPull) {
  Task task = std::move(tasks(0.005)[2]);
  task.scene.lesion.emplace();
  task.scene.lesion->shape = SceneRegion::Shape::kSphere;
  task.scene.lesion->center = {0, 0, 0};
  task.scene.lesion->radius = 0.01;
  Session session = make(task.scene);
  close(session);
  greatest(session, task.closes, [] { return 0.0; });
  lead(session, task.to, task.rotation, task.over);
  const double most = greatest(session, task.closes + 1.5, [&] { return norm(session.tools()[0].force); });
  EXPECT_GT(most, 0.9 * norm(session.support_force()));
  EXPECT_EQ(session.score()->largest_force, most);
}

TEST(ToolForces, BelongToTheLastStepAndAreNoState) {
  Task task = std::move(tasks(0.005)[1]);
  Session session = make(task.scene);
  lead(session, task.to, task.rotation, task.over);
  greatest(session, 0.3, [] { return 0.0; });
  const auto snapshot = session.snapshot();
  ASSERT_TRUE(session.step(1).ok());
  const Session::ToolState once = session.tools()[0];
  EXPECT_GT(norm(once.force), 0.02);
  session.restore(snapshot);
  EXPECT_EQ(norm(session.tools()[0].force), 0) << "from another time";
  EXPECT_EQ(norm(session.tools()[0].coupling_force), 0);
  ASSERT_TRUE(session.step(1).ok());
  EXPECT_EQ(session.tools()[0].force, once.force);
  EXPECT_EQ(session.tools()[0].torque, once.torque);
  EXPECT_EQ(session.tools()[0].coupling_force, once.coupling_force);
}

}  // namespace
}  // namespace kerf::tool_forces_test
