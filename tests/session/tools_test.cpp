// Tools as bodies: edges that press and cut, jaws that hold, the force that they feel.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "kerf/base/rigid_place.h"
#include "kerf/session/session.h"
#include "session/make_session.h"

namespace kerf::tools_test {
namespace {

using test::make;

void expect_valid(const Session& session) {
  const Status valid = session.validate();
  EXPECT_TRUE(valid.ok()) << valid.error().message;
}

/// A strip along x, 3 mm thick, held at both ends, without weight.
Scene strip_scene() {
  Scene scene;
  scene.body.model = "strip";
  scene.body.options.visual_triangles = 1000;
  scene.simulation.time_step = 0.002;
  scene.simulation.gravity = {};
  for (const double side : {-1.0, 1.0}) {
    SceneFix fix;
    fix.region.shape = SceneRegion::Shape::kHalfSpace;
    fix.region.point = {0.095 * side, 0, 0};
    fix.region.normal = {side, 0, 0};
    scene.fixes.push_back(fix);
  }
  return scene;
}

SceneRigidTool tool_of(SceneToolKind kind, Vec3 position, Vec3 rotation = {}) {
  SceneRigidTool tool;
  tool.id = "tool";
  tool.kind = kind;
  tool.position = position;
  tool.rotation = rotation;
  return tool;
}

void lead(Session& session, std::vector<ScenePose> poses) {
  SceneCommand command;
  command.what = SceneToolMotion{"tool", std::move(poses)};
  const Status done = session.apply(command);
  ASSERT_TRUE(done.ok()) << done.error().message;
}

/// A scalpel whose edge stands upright and faces +y: across the strip.
constexpr Vec3 kFacingY{0, 0, std::numbers::pi / 2};

TEST(Tools, AnEdgeCutsWhatItIsLedThrough) {
  Scene scene = strip_scene();
  scene.tools = {tool_of(SceneToolKind::kScalpel, {0.003, -0.03, -0.012}, kFacingY)};
  Session session = make(scene);
  lead(session, {{0.4, {0.003, 0.03, -0.012}, kFacingY}});
  ASSERT_TRUE(session.step(150).ok());
  expect_valid(session);
  EXPECT_TRUE(session.in_stroke()) << "half-way";
  ASSERT_TRUE(session.step(100).ok());
  expect_valid(session);
  EXPECT_FALSE(session.in_stroke());
  EXPECT_EQ(session.counts().pieces, 2);
  ASSERT_EQ(session.undo_depth(), 1);
  ASSERT_TRUE(session.undo().ok());
  EXPECT_EQ(session.counts().pieces, 1);
  expect_valid(session);
}

TEST(Tools, ALongEdgeCutsThinMaterialWhereverItMeetsIt) {
  // Looked at in nine places of an edge of 60 mm, a strip 3 mm thick could lie between two of them.
  for (const double tip : {-0.00825, -0.01125, -0.012}) {
    Scene scene = strip_scene();
    scene.tools = {tool_of(SceneToolKind::kScalpel, {0.003, -0.03, tip}, kFacingY)};
    scene.tools[0].tip = 0.06;
    Session session = make(scene);
    lead(session, {{0.4, {0.003, 0.03, tip}, kFacingY}});
    ASSERT_TRUE(session.step(250).ok());
    expect_valid(session);
    EXPECT_FALSE(session.in_stroke()) << tip;
    EXPECT_EQ(session.counts().pieces, 2) << tip;
    EXPECT_EQ(session.undo_depth(), 1) << tip;
  }
}

TEST(Tools, BladesAndJawsOfAnySizeHaveAShape) {
  for (const SceneToolKind kind : {SceneToolKind::kScalpel, SceneToolKind::kScissors, SceneToolKind::kGrasper})
    for (const double tip : {0.0005, 0.02})
      for (const double width : {0.0005, 0.004})
        for (const double thickness : {0.0003, 0.004, 0.02}) {
          Scene scene = strip_scene();
          scene.tools = {tool_of(kind, {0, 0, 0.05})};
          scene.tools[0].tip = tip;
          scene.tools[0].width = width;
          scene.tools[0].thickness = thickness;
          const auto session = Session::create(scene);
          EXPECT_TRUE(session.ok()) << tip << " " << width << " " << thickness << ": "
                                    << (session.ok() ? "" : session.error().message);
        }
}

TEST(Tools, ABluntEdgePresses) {
  Scene scene = strip_scene();
  scene.tools = {tool_of(SceneToolKind::kScalpel, {0.003, -0.03, -0.012}, kFacingY)};
  scene.tools[0].sharp = false;
  Session session = make(scene);
  lead(session, {{0.4, {0.003, -0.005, -0.012}, kFacingY}});
  ASSERT_TRUE(session.step(250).ok());
  expect_valid(session);
  EXPECT_EQ(session.counts().pieces, 1);
  EXPECT_EQ(session.undo_depth(), 0);
  const Session::ToolState tool = session.tools()[0];
  EXPECT_LT(tool.force.y, -0.02) << "the strip pushes back";
  EXPECT_GT(session.support_force().y, -2) << "it is bent, not torn off";
}

TEST(Tools, MaterialGivesWayAtItsResistance) {
  // Pressed against an edge, it gives way once its force exceeds resistance times the length of the edge that presses.
  struct Row {
    double resistance;
    bool cuts;
  };
  for (const Row row : {Row{1.0, true}, Row{1e5, false}}) {
    Scene scene = strip_scene();
    scene.cut.resistance = row.resistance;
    scene.tools = {tool_of(SceneToolKind::kScalpel, {0.003, -0.03, -0.012}, kFacingY)};
    Session session = make(scene);
    lead(session, {{0.6, {0.003, 0.008, -0.012}, kFacingY}});
    double pressed = 0;
    bool cut = false;
    for (int i = 0; i < 300; ++i) {
      ASSERT_TRUE(session.step(1).ok());
      if (!session.in_stroke() && !cut) pressed = std::max(pressed, -session.tools()[0].force.y);
      cut = cut || session.in_stroke();
    }
    expect_valid(session);
    EXPECT_EQ(cut, row.cuts) << row.resistance;
    EXPECT_GT(pressed, 0) << "first it presses";
    EXPECT_EQ(session.undo_depth() > 0 || session.in_stroke(), row.cuts);
  }
}

TEST(Tools, JawsHoldWhatTheyCloseOn) {
  Scene scene = strip_scene();
  scene.fixes.pop_back();  // held on the left only
  // Jaws open along x in the tool's axes; turned so that they open along z and reach along -x, onto the free end.
  const Vec3 turned{0, std::numbers::pi / 2, 0};
  scene.tools = {tool_of(SceneToolKind::kGrasper, {0.092, 0, 0}, turned)};
  scene.tools[0].tip = 0.016;
  Session session = make(scene);
  ASSERT_TRUE(session.step(5).ok());
  SceneCommand close;
  close.what = SceneJaws{"tool", true, 0.1};
  ASSERT_TRUE(session.apply(close).ok());
  ASSERT_TRUE(session.step(100).ok());
  ASSERT_EQ(session.grasps().size(), 1u) << "it holds";
  const Vec3 before = session.grasps()[0].held;
  lead(session, {{0.3, {0.090, 0, 0.03}, turned}});
  ASSERT_TRUE(session.step(300).ok());
  expect_valid(session);
  EXPECT_NEAR(session.grasps()[0].held.z - before.z, 0.03, 0.006) << "it takes the tissue along";
  EXPECT_GT(session.tools()[0].coupling_force.z, 0) << "and the pose must pull";
  SceneCommand open;
  open.what = SceneJaws{"tool", false, 0.1};
  ASSERT_TRUE(session.apply(open).ok());
  ASSERT_TRUE(session.step(50).ok());
  EXPECT_TRUE(session.grasps().empty());
}

TEST(Tools, ScissorsCutWhereTheyClose) {
  Scene scene = strip_scene();
  // Shaft along -y behind, blades reaching along +y across the strip, opening along z: x -> z, z -> -y.
  const Mat3 axes{{Vec3{0, 0, 1}, Vec3{-1, 0, 0}, Vec3{0, -1, 0}}};
  const Vec3 turned = turn_of(axes);
  scene.tools = {tool_of(SceneToolKind::kScissors, {0.003, 0.016, 0}, turned)};
  scene.tools[0].tip = 0.034;
  Session session = make(scene);
  ASSERT_TRUE(session.step(5).ok());
  EXPECT_EQ(session.counts().pieces, 1);
  SceneCommand close;
  close.what = SceneJaws{"tool", true, 0.2};
  ASSERT_TRUE(session.apply(close).ok());
  ASSERT_TRUE(session.step(150).ok());
  expect_valid(session);
  EXPECT_EQ(session.counts().pieces, 2);
  EXPECT_FALSE(session.in_stroke());
}

/// Scissors that reach across a strip from its side and have cut it by about half.
Session half_cut_by_scissors(double dt) {
  Scene scene = strip_scene();
  scene.lattice.cells = std::array<int, 3>{50, 8, 1};
  scene.simulation.time_step = dt;
  scene.material.young = 1e5;
  const Mat3 axes{{Vec3{0, 0, 1}, Vec3{-1, 0, 0}, Vec3{0, -1, 0}}};
  // Hinge at y = -18 mm, tips at y = 2 mm.
  scene.tools = {tool_of(SceneToolKind::kScissors, {0.003, 0.002, 0}, turn_of(axes))};
  scene.tools[0].thickness = 0.001;
  Session session = make(scene);
  EXPECT_TRUE(session.step(static_cast<int>(std::ceil(0.02 / dt))).ok());
  SceneCommand close;
  close.what = SceneJaws{"tool", true, 0.2};
  EXPECT_TRUE(session.apply(close).ok());
  EXPECT_TRUE(session.step(static_cast<int>(std::ceil(0.6 / dt))).ok());
  return session;
}

TEST(Tools, ScissorsPushTheLipsThatTheyLeft) {
  for (const double dt : {0.001, 0.005, 0.0167}) {
    Session session = half_cut_by_scissors(dt);
    expect_valid(session);
    EXPECT_FALSE(session.in_stroke()) << dt << ": shut, they cut no more";
    EXPECT_EQ(session.counts().pieces, 1);
    EXPECT_EQ(session.undo_depth(), 1);
    const std::uint64_t version = session.topology_version();
    const Vec3 at_rest = session.tools()[0].force;
    EXPECT_LT(std::fabs(at_rest.x), 0.01) << dt << ": both lips push alike";
    const Vec3 turned = session.scene().tools[0].rotation;
    for (const double way : {0.002, -0.002}) {
      lead(session, {{0.3, {0.003 + way, 0.002, 0}, turned}});
      ASSERT_TRUE(session.step(static_cast<int>(std::ceil(1.2 / dt))).ok());
      const Session::ToolState tool = session.tools()[0];
      EXPECT_LT(tool.force.x * way, -0.05 * std::fabs(way)) << dt << ": the strip pushes back";
      EXPECT_NEAR(tool.force.x, session.support_force().x, 0.003) << dt << ": with what its supports hold";
      // Lips lie on their sides of the blades.
      const CollisionMesh& mesh = session.body().complex.collision;
      const RigidPlace place{tool.place.position, tool.place.axes};
      int beside = 0;
      for (const CollisionTriangle f : ids<CollisionTriangle>(mesh.face_count()))
        for (int k = 0; k < 3; ++k) {
          const CollisionHalfEdge h = CollisionMesh::corner(f, k);
          if (mesh.twin[h].valid() || !mesh.wall[h].valid()) continue;
          const auto local = [&](CollisionVertex v) {
            return place.to_local(session.collision_positions()[v.index()]);
          };
          const Vec3 a = local(mesh.from(h)), b = local(mesh.to(h)), c = local(mesh.apex(h));
          if (std::min(a.z, b.z) < 0.005) continue;
          ++beside;
          const double side = c.y > 0.5 * (a.y + b.y) ? 1 : -1;
          EXPECT_GT(side * 0.5 * (a.y + b.y), -0.0001) << dt << " " << way;
        }
      EXPECT_GT(beside, 1) << dt;
    }
    EXPECT_EQ(session.topology_version(), version) << dt;
    // Out of the slit they are a body like others.
    lead(session, {{0.1, {0.003, 0.002, 0}, turned}, {0.4, {0.003, -0.03, 0}, turned}});
    ASSERT_TRUE(session.step(static_cast<int>(std::ceil(0.8 / dt))).ok());
    EXPECT_LT(norm(session.tools()[0].force), 0.001) << dt;
    lead(session, {{0.1, {0.03, -0.03, 0}, turned}, {0.5, {0.03, -0.01, 0}, turned}});
    ASSERT_TRUE(session.step(static_cast<int>(std::ceil(1.0 / dt))).ok());
    EXPECT_LT(session.tools()[0].force.y, -0.01) << dt << ": shut, they press";
    EXPECT_EQ(session.topology_version(), version) << dt;
    expect_valid(session);
  }
}

TEST(Tools, ScissorsThatOpenGoOnInTheirSlit) {
  for (const double dt : {0.001, 0.005, 0.0167}) {
    Session session = half_cut_by_scissors(dt);
    double fastest = 0;
    const auto jaws = [&](bool closed) {
      SceneCommand command;
      command.what = SceneJaws{"tool", closed, 0.2};
      ASSERT_TRUE(session.apply(command).ok());
      for (int i = 0; i < static_cast<int>(std::ceil(0.3 / dt)); ++i) {
        const auto done = session.step();
        ASSERT_TRUE(done.ok());
        fastest = std::max(fastest, done->mechanics.kinetic_energy);
      }
    };
    jaws(false);
    lead(session, {{0.2, {0.003, 0.0075, 0}, session.scene().tools[0].rotation}});
    ASSERT_TRUE(session.step(static_cast<int>(std::ceil(0.3 / dt))).ok());
    // One lip over a blade and one under the other, they would stand centimetres apart.
    const auto& rest = session.body().complex.collision.rest;
    const std::vector<Vec3> now = session.collision_positions();
    double moved = 0;
    for (const CollisionVertex v : ids<CollisionVertex>(rest.size()))
      moved = std::max(moved, norm(now[v.index()] - rest[v]));
    EXPECT_LT(moved, 0.001) << dt;
    EXPECT_EQ(session.undo_depth(), 1) << dt;
    jaws(true);
    expect_valid(session);
    // The slit goes on from its end: one slit, with the rim one border of the mesh, to where the tips are.
    const CollisionMesh& mesh = session.body().complex.collision;
    double end = -1;
    int slit_ends = 0;
    for (const CollisionVertex v : ids<CollisionVertex>(rest.size())) {
      double material = 0;  // rad, around the vertex
      if (!mesh.on_border(v)) continue;
      mesh.for_each_outgoing(v, [&](CollisionHalfEdge h) {
        const Vec3 a = normalized(rest[mesh.to(h)] - rest[v]), b = normalized(rest[mesh.apex(h)] - rest[v]);
        material += std::acos(std::clamp(dot(a, b), -1.0, 1.0));
        return true;
      });
      if (material < 1.5 * std::numbers::pi) continue;
      ++slit_ends;
      end = rest[v].y;
    }
    EXPECT_EQ(slit_ends, 1) << dt << ": no nicks in its lips";
    EXPECT_NEAR(end, 0.0075, 0.0015) << dt;
    // The shaft, which stands at the slit's mouth by now, touches the rim from the start: lips that come past the hinge don't find themselves in it.
    EXPECT_LT(fastest, 1e-5) << dt << ": J";
  }
}

TEST(Tools, AJumpOfThePoseIsFollowedAtBoundedSpeed) {
  Scene scene = strip_scene();
  scene.tools = {tool_of(SceneToolKind::kSphere, {0, 0, 0.5})};
  scene.tools[0].max_speed = 2;
  scene.tools[0].max_force = 0;
  Session session = make(scene);
  lead(session, {{0.0, {0, 0, -0.5}, {}}});
  Vec3 last = session.tools()[0].place.position;
  for (int i = 0; i < 400; ++i) {
    ASSERT_TRUE(session.step(1).ok());
    const Vec3 now = session.tools()[0].place.position;
    EXPECT_LE(norm(now - last), 2 * 0.002 * 1.01);  // what it strikes may add a little, its coupling nothing
    last = now;
  }
  expect_valid(session);
}

TEST(Tools, TheSameBitsAfterARestore) {
  Scene scene = strip_scene();
  scene.cut.resistance = 5;
  scene.tools = {tool_of(SceneToolKind::kScalpel, {0.003, -0.03, -0.012}, kFacingY)};
  Session session = make(scene);
  lead(session, {{0.4, {0.003, 0.03, -0.012}, kFacingY}});
  ASSERT_TRUE(session.step(60).ok());
  const auto snapshot = session.snapshot();
  ASSERT_TRUE(session.step(120).ok());
  const std::uint64_t once = session.hash();
  session.restore(snapshot);
  ASSERT_TRUE(session.step(120).ok());
  EXPECT_EQ(session.hash(), once);
}

}  // namespace
}  // namespace kerf::tools_test
