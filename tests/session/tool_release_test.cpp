// Blades and jaws that touch nothing for a while (half open scissors, an edge that cuts, jaws that hold) and touch again: what is in each other by then comes
// apart by itself. It must not be thrown, nor be called a contact.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "kerf/base/rigid_place.h"
#include "kerf/session/session.h"
#include "session/make_session.h"

namespace kerf::tool_release_test {
namespace {

using test::make;

double half_thickness(const Session& session) {
  double most = 0;
  for (const Vec3& o : session.body().complex.collision.offset.raw()) most = std::max(most, norm(o));
  return most;
}

struct Worst {
  double deep = 0;  ///< half thicknesses: of a contact with a tool
  double fast = 0;  ///< m/s: of a node
};

Worst run(Session& session, double seconds) {
  Worst worst;
  const double radius = half_thickness(session), until = session.time() + seconds;
  while (session.time() < until - 1e-9) {
    const auto step = session.step();
    EXPECT_TRUE(step.ok());
    if (!step.ok()) return worst;
    for (const Session::ContactState& c : session.contacts())
      if (c.tool >= 0) worst.deep = std::max(worst.deep, -c.gap / radius);
    for (const Vec3& v : session.node_velocities()) worst.fast = std::max(worst.fast, norm(v));
  }
  return worst;
}

void add(Scene& scene, double at, decltype(SceneCommand::what) what) {
  SceneCommand command;
  command.at = at;
  command.what = std::move(what);
  scene.commands.push_back(std::move(command));
}

void hold_beyond(Scene& scene, double x, double side) {
  SceneFix fix;
  fix.region.shape = SceneRegion::Shape::kHalfSpace;
  fix.region.point = {x, 0, 0};
  fix.region.normal = {side, 0, 0};
  scene.fixes.push_back(fix);
}

void add_floor(Scene& scene, double z) {
  SceneObstacle& floor = scene.obstacles.emplace_back();
  floor.shape = SceneShape::kPlane;
  floor.position = {0, 0, z};
}

Scene held_strip(double dt) {
  Scene scene;
  scene.body.model = "strip";
  scene.body.options.visual_triangles = 1000;
  scene.simulation.time_step = dt;
  scene.simulation.gravity = {};
  hold_beyond(scene, 0.095, 1);
  hold_beyond(scene, -0.095, -1);
  return scene;
}

/// Jaws that reach along +y across the strip's border and open along z.
Mat3 across_the_border() { return {{Vec3{0, 0, 1}, Vec3{-1, 0, 0}, Vec3{0, -1, 0}}}; }

SceneRigidTool tool_of(SceneToolKind kind, Vec3 position, Vec3 rotation) {
  SceneRigidTool tool;
  tool.id = "tool";
  tool.kind = kind;
  tool.position = position;
  tool.rotation = rotation;
  return tool;
}

TEST(ToolRelease, JawsThatTurnWithWhatTheyHoldAndOpenThrowNothing) {
  for (const double dt : {0.001, 0.005, 0.0167})
    for (const int axis : {0, 1}) {
      Scene scene = held_strip(dt);
      const Mat3 axes = across_the_border();
      scene.tools = {tool_of(SceneToolKind::kGrasper, {0.003, -0.005, 0}, turn_of(axes))};
      scene.tools[0].tip = 0.016;
      add(scene, 0.02, SceneJaws{"tool", true, 0.1});
      Vec3 by;
      by[axis] = 0.6;
      add(scene, 0.22, SceneToolMotion{"tool", {{0.15, {0.003, -0.005, 0.004}, turn_of(product(turn(by), axes))}}});
      add(scene, 0.52, SceneJaws{"tool", false, 0.1});
      Session session = make(scene);
      run(session, 0.5);
      ASSERT_EQ(session.grasps().size(), 1u) << dt;
      const Worst after = run(session, 0.2);
      EXPECT_TRUE(session.grasps().empty());
      EXPECT_LT(after.deep, 0.3) << dt << " " << axis;
      EXPECT_LT(after.fast, 1.0) << dt << " " << axis;
    }
}

// In one long step: the jaw that comes down on a strip beside the tool's middle does not go through it.
TEST(ToolRelease, JawsThatCloseWithinAStepTakeHoldOfWhatLiesBetween) {
  Scene scene = held_strip(0.0167);
  const Mat3 axes = across_the_border();
  scene.tools = {tool_of(SceneToolKind::kGrasper, {0.003, -0.007, -0.004}, turn_of(axes))};
  scene.tools[0].tip = 0.03;
  add(scene, 0.02, SceneJaws{"tool", true, 0.0167});
  Session session = make(scene);
  int parts = 0;
  for (int i = 0; i < 12; ++i) {
    const auto step = session.step();
    ASSERT_TRUE(step.ok());
    parts = std::max(parts, step->parts);
  }
  EXPECT_GE(parts, 4) << "the tips turn by 9 mm";
  EXPECT_EQ(session.grasps().size(), 1u) << "it holds";
}

// Half open, they are led into a tube, and close there: they cut, and what lies through their blades is not thrown off them.
TEST(ToolRelease, ScissorsThatCloseInATubeThrowNothing) {
  Scene scene;
  scene.body.model = "tube";
  scene.simulation.time_step = 0.001;
  scene.material.young = 957e3;
  scene.contact.friction = 0.57;
  hold_beyond(scene, -0.0252, -1);
  scene.tools = {tool_of(SceneToolKind::kScissors, {-0.0913864, 0.00874808, 0.047697}, {0.686396, -1.09779, 1.41815})};
  scene.tools[0].tip = 0.0374534;
  add(scene, 0.02,
      SceneToolMotion{"tool",
                      {{0.0854748, {-0.0298529, 0.0404037, 0.0106139}, {1.06182, -0.85262, 1.7336}},
                       {0.35313, {-0.0106848, -0.0486647, 0.000633019}, {0.866801, -1.38836, 0.920042}}}});
  add(scene, 0.2, SceneJaws{"tool", true, 0.2});
  Session session = make(scene);
  const Worst worst = run(session, 0.28);
  EXPECT_LT(worst.deep, 0.3);
  EXPECT_LT(worst.fast, 4);
}

// Scissors that close become a wider blade, behind whose middle an end of their slit comes to be that was ahead of it.
TEST(ToolRelease, TheEndOfASlitIsNotInTheScissorsThatCutIt) {
  Scene scene;
  scene.body.model = "steak";
  scene.simulation.time_step = 0.0167;
  scene.material.young = 255938.02453914811;
  scene.contact.friction = 0.45853604103509882;
  scene.cut.resistance = 5.8800828199785293;
  hold_beyond(scene, -0.0839331, -1);
  add_floor(scene, -0.103287);
  SceneObstacle capsule;
  capsule.shape = SceneShape::kCapsule;
  capsule.position = {0.0534879, 0.0346708, -0.0383918};
  capsule.rotation = {-0.524862, -0.0900297, 0.134133};
  capsule.radius = 0.00949939;
  capsule.length = 0.0573315;
  SceneObstacle ball;
  ball.shape = SceneShape::kSphere;
  ball.position = {0.00178116, 0.00818428, -0.0383918};
  ball.radius = 0.0134029;
  scene.obstacles.push_back(capsule);
  scene.obstacles.push_back(ball);
  scene.tools = {tool_of(SceneToolKind::kScissors, {0.0962334, 0.151169, 0.121452}, {-0.927848, 1.16048, 0.372266})};
  scene.tools[0].tip = 0.0461148;
  add(scene, 0.02,
      SceneToolMotion{"tool",
                      {{0.378465, {0.0678869, 0.00772112, -0.00906294}, {-0.346246, 1.06101, 0.949891}},
                       {0.439839, {0.0858341, 0.0472475, 0.0238868}, {-0.954376, 1.00517, -0.132629}}}});
  add(scene, 0.2, SceneJaws{"tool", true, 0.195622});
  Session session = make(scene);
  const Worst worst = run(session, 0.42);
  EXPECT_LT(worst.deep, 0.3);
}

// A scalpel that turns and is drawn back beside the slit that it cut into a shell: lips that have come to its other side are let through.
TEST(ToolRelease, LipsThatTurnPastABladeAreNotThrown) {
  Scene scene;
  scene.body.model = "half-shell";
  scene.simulation.time_step = 0.001;
  scene.material.young = 103703.52512987507;
  scene.contact.friction = 0.12411376391135524;
  scene.cut.resistance = 21.222315835714308;
  hold_beyond(scene, -0.0427808, -1);
  add_floor(scene, -0.112674);
  scene.tools = {tool_of(SceneToolKind::kScalpel, {-0.0201359, -0.087826, 0.0143859}, {-1.31672, -1.23243, 1.22927})};
  scene.tools[0].tip = 0.0506513;
  add(scene, 0.02,
      SceneToolMotion{"tool",
                      {{0.0936101, {0.0225306, -0.017715, -0.0163313}, {-0.912661, -0.978484, 0.790313}},
                       {0.148815, {-0.00437378, 0.0253967, -0.0148673}, {-0.855835, -0.578899, 1.74933}},
                       {0.504471, {-0.036958, -0.0245535, -0.0319045}, {-1.90886, -1.64671, 1.63785}},
                       {0.542531, {-0.0121845, -0.0217293, -0.0160567}, {-1.55414, -1.84424, 0.596455}}}});
  Session session = make(scene);
  const Worst worst = run(session, 0.6);
  EXPECT_LT(worst.deep, 0.5);
  EXPECT_LT(worst.fast, 4);
}

}  // namespace
}  // namespace kerf::tool_release_test
