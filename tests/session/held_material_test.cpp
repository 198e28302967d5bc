// What fixed regions hold is material: answers do not hang on where cells end.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "session/beam_strip.h"
#include "session/make_session.h"

namespace kerf::held_material_test {
namespace {

using namespace test::beam_strip;
using test::make;

// Only nodes in the region were held: up to a cell less of the strip, and 20 % more sag here.
TEST(HeldMaterial, ABeamIsAsLongAsItIsFree) {
  constexpr double young = 2e9;
  for (const double share : {0.0, 0.02, 0.4, 0.98}) {
    Scene scene = strip(young);
    const double border = -kLength / 2 + kCell * (3 + share);
    scene.fixes.push_back(left_of(border));
    Session session = make(scene);
    const double truth = beam(young, kLength / 2 - border), got = sag(session);
    EXPECT_NEAR(got, truth, 0.03 * truth) << share;
    const double weight = kWeight * kLength * kWidth * kThickness;
    EXPECT_NEAR(session.support_force().z, weight, 0.01 * weight) << share;
    Vec3 sum;
    for (const NodeId n : ids<NodeId>(session.body().hex.node_count())) sum += session.support_force(n);
    EXPECT_NEAR(norm(sum - session.support_force()), 0, 1e-12 * weight) << share;
    const auto kept = session.snapshot();
    session.restore(kept);
    ASSERT_TRUE(session.step().ok());
    EXPECT_NEAR(session.support_force().z, weight, 0.01 * weight) << share;
    EXPECT_TRUE(session.validate().ok());
  }
}

TEST(HeldMaterial, LessThanACellIsHeldWhereItIs) {
  constexpr double young = 2e9;
  Scene scene = strip(young);
  SceneFix fix;
  fix.region.min = {-kLength / 2 - 1, -1, -1};
  fix.region.max = {-kLength / 2 + 0.3 * kCell, 1, 1};
  scene.fixes.push_back(fix);
  Session session = make(scene);
  const double truth = beam(young, kLength - 0.3 * kCell);
  EXPECT_NEAR(sag(session), truth, 0.03 * truth);
}

/// Highest place of the middle surface, m.
double highest(Session& session) {
  double z = -HUGE_VAL;
  for (const Vec3 x : session.collision_positions()) z = std::max(z, x.z);
  return z;
}
SceneFix box_up_to(double x) {
  SceneFix fix;
  fix.region.min = {-1, -1, -1};
  fix.region.max = {x, 1, 1};
  return fix;
}
SceneFix ball(Vec3 center, double radius) {
  SceneFix fix;
  fix.region.shape = SceneRegion::Shape::kSphere;
  fix.region.center = center;
  fix.region.radius = radius;
  return fix;
}
void fix(Session& session, const SceneRegion& region) {
  SceneCommand command;
  command.what = SceneFixCommand{region};
  ASSERT_TRUE(session.apply(command).ok());
}
void unfix(Session& session, const SceneRegion& region) {
  SceneCommand command;
  command.what = SceneUnfix{region};
  ASSERT_TRUE(session.apply(command).ok());
}
void take_steps(Session& session, int n) {
  for (int i = 0; i < n; ++i) {
    const auto done = session.step();
    ASSERT_TRUE(done.ok()) << done.error().message;
  }
}

TEST(HeldMaterial, UnfixLetsGoOfIt) {
  Scene scene = strip(2e9);
  scene.fixes.push_back(left_of(-kLength / 2 + 3.4 * kCell));
  Session session = make(scene);
  take_steps(session, 10);
  unfix(session, left_of(-kLength / 2 + 4 * kCell).region);
  take_steps(session, 10);
  EXPECT_LT(norm(session.support_force()), 1e-12);
  EXPECT_LT(highest(session), -0.01);  // all of it falls
}

// The border was taken for the middle of the last bracket, which lies outside of the region half of the time: nothing was let go.
TEST(HeldMaterial, UnfixLetsGoOfLessThanACell) {
  for (int tenths = 1; tenths < 10; ++tenths) {
    Scene scene = strip(2e9);
    scene.fixes.push_back(box_up_to(-kLength / 2 + 0.1 * tenths * kCell));
    Session session = make(scene);
    unfix(session, scene.fixes[0].region);
    take_steps(session, 10);
    EXPECT_LT(highest(session), -0.01) << tenths;
  }
}

// All nodes were set again from the regions, so what nodes alone had held or let go was lost.
TEST(HeldMaterial, WhatNodesHoldStaysSo) {
  const double border = -kLength / 2 + 3.4 * kCell;
  const auto held = [](const Session& session) {
    std::vector<bool> out;
    for (const NodeId n : ids<NodeId>(session.body().hex.node_count())) out.push_back(session.is_fixed(n));
    return out;
  };
  const auto count = [](const std::vector<bool>& flags) { return std::count(flags.begin(), flags.end(), true); };
  {  // A small region in a cell that a later border crosses.
    Scene scene = strip(1e6);
    Session small = make(scene);
    const Vec3 vertex = [&] {
      Vec3 best{HUGE_VAL, 0, 0};
      for (const Vec3 x : small.body().complex.collision.rest.raw())
        if (std::fabs(x.x - (-kLength / 2 + 3.5 * kCell)) < std::fabs(best.x - (-kLength / 2 + 3.5 * kCell))) best = x;
      return best;
    }();
    fix(small, ball(vertex, 1e-4).region);
    const std::vector<bool> alone = held(small);
    EXPECT_EQ(count(alone), 8);
    fix(small, left_of(border).region);
    const std::vector<bool> both = held(small);
    for (std::size_t i = 0; i < both.size(); ++i) EXPECT_TRUE(both[i] || !alone[i]) << i;
  }
  {  // Fixed late, while another region is let go.
    Scene scene = strip(1e6);
    scene.fixes.push_back(left_of(border));
    SceneFix right = left_of(0);
    right.region.point = {kLength / 2 - 2.4 * kCell, 0, 0};
    right.region.normal = {1, 0, 0};
    scene.fixes.push_back(right);
    Session session = make(scene);
    take_steps(session, 1);
    SceneFix late;
    late.region.min = {-kLength / 2 + 2.9 * kCell, -1, -1};
    late.region.max = {-kLength / 2 + 4.1 * kCell, 1, 1};
    fix(session, late.region);
    const std::vector<bool> then = held(session);
    unfix(session, right.region);
    const std::vector<bool> now = held(session);
    for (const NodeId n : ids<NodeId>(now.size()))
      EXPECT_TRUE(session.body().hex.rest(n).x > 0 || now[n.index()] == then[n.index()]) << n.value;
    EXPECT_LT(count(now), count(then));
  }
  {  // One node in the middle of it is let go.
    Scene scene = strip(1e6);
    scene.fixes.push_back(left_of(border));
    Session session = make(scene);
    const std::vector<bool> then = held(session);
    unfix(session, ball({-kLength / 2 + kCell, -kWidth / 2 + kCell, kThickness / 2}, 4e-4).region);
    EXPECT_EQ(count(held(session)), count(then) - 1);
  }
}

// A chip on the held side of a crossed cell has no material at the border: nothing held it.
TEST(HeldMaterial, ACutBesideItsBorderLeavesBothSidesHeld) {
  for (const double share : {0.3, 0.5, 0.8}) {
    Scene scene = strip(1e6);
    scene.fixes.push_back(left_of(-kLength / 2 + (3 + share) * kCell));
    Session session = make(scene);
    ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, true).ok());
    const double x = -kLength / 2 + 3.25 * kCell;
    for (const double y : {-0.02, 0.02}) ASSERT_TRUE(session.move_blade({x, y, 0.01}, {x, y, -0.01}).ok());
    ASSERT_TRUE(session.end_stroke().ok());
    ASSERT_EQ(session.counts().pieces, 2);
    take_steps(session, 30);
    // Nodes of the cell that lie on the held side, as both parts have them.
    const HexMesh& hex = session.body().hex;
    double most = 0;
    for (const HexId h : ids<HexId>(hex.hex_count())) {
      if (!hex.alive(h) || hex.rest(hex.nodes[h][0]).x > x) continue;
      for (const NodeId n : hex.nodes[h])
        if (hex.rest(n).x < x) most = std::max(most, norm(session.node_positions()[n.index()] - hex.rest(n)));
    }
    EXPECT_LT(most, 1e-3) << share;
    EXPECT_TRUE(session.validate().ok());
  }
}

TEST(HeldMaterial, ACutThroughItLeavesBothPartsHeld) {
  Scene scene = strip(1e6);
  const double border = -kLength / 2 + 3.4 * kCell;
  scene.fixes.push_back(left_of(border));
  Session session = make(scene);
  const std::uint64_t whole = session.hash();
  const auto lead = [&] {
    ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, true).ok());
    for (const double x : {-0.12, 0.12}) ASSERT_TRUE(session.move_blade({x, 0.001, 0.01}, {x, 0.001, -0.01}).ok());
  };
  lead();
  ASSERT_TRUE(session.cancel_stroke().ok());
  EXPECT_EQ(session.hash(), whole);
  lead();
  ASSERT_TRUE(session.end_stroke().ok());
  const std::uint64_t cut = session.hash();
  ASSERT_TRUE(session.undo().ok());
  EXPECT_EQ(session.hash(), whole);
  ASSERT_TRUE(session.redo().ok());
  EXPECT_EQ(session.hash(), cut);
  EXPECT_EQ(session.counts().pieces, 2);
  take_steps(session, 50);
  // Held vertices stay by definition; nodes beyond the border tell, those of both parts.
  const HexMesh& hex = session.body().hex;
  int beside = 0;
  for (const NodeId n : ids<NodeId>(hex.node_count())) {
    if (!hex.active(n) || hex.rest(n).x <= border || hex.rest(n).x > border + kCell) continue;
    ++beside;
    EXPECT_LT(norm(session.node_positions()[n.index()] - hex.rest(n)), 1e-3);
  }
  EXPECT_EQ(beside, 12);
  EXPECT_TRUE(session.validate().ok());
}

// Cells that come back with a piece had no springs, and nodes that were let go meanwhile were fixed again.
TEST(HeldMaterial, AnUndoneRemovalLeavesSupportsAsTheyAre) {
  Scene scene = strip(1e6);
  const double border = -kLength / 2 + 3.4 * kCell;
  scene.fixes.push_back(left_of(border));
  SceneFix right = left_of(0);
  right.region.point = {kLength / 2 - 2.4 * kCell, 0, 0};
  right.region.normal = {1, 0, 0};
  scene.fixes.push_back(right);
  const auto cut = [&](Session& session) {
    ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, true).ok());
    const double x = border + 2 * kCell;
    for (const double y : {-0.02, 0.02}) ASSERT_TRUE(session.move_blade({x, y, 0.01}, {x, y, -0.01}).ok());
    ASSERT_TRUE(session.end_stroke().ok());
  };
  SceneCommand grasp, remove;
  SceneGrasp hand;
  hand.id = "hand";
  hand.point = {-kLength / 2, 0, 0};
  grasp.what = hand;
  SceneRemove what;
  what.grasp = "hand";
  remove.what = what;
  Session first = make(scene), then = make(scene);
  cut(first), cut(then);
  for (Session* session : {&first, &then}) {
    ASSERT_TRUE(session->apply(grasp).ok());
    ASSERT_TRUE(session->apply(remove).ok());
  }
  ASSERT_EQ(first.counts().pieces, 1);
  unfix(first, right.region);
  ASSERT_TRUE(first.undo().ok());
  ASSERT_TRUE(then.undo().ok());
  unfix(then, right.region);
  ASSERT_EQ(first.counts().pieces, 2);
  for (const NodeId n : ids<NodeId>(first.body().hex.node_count()))
    EXPECT_EQ(first.is_fixed(n), then.is_fixed(n)) << n.value;
  take_steps(first, 20);
  take_steps(then, 20);
  EXPECT_EQ(first.support_force(), then.support_force());
  EXPECT_GT(first.support_force().z, 0);
}

TEST(HeldMaterial, TheHashKnowsWhatIsHeld) {
  Scene scene = strip(1e6);
  scene.fixes.push_back(left_of(-kLength / 2 + 3.3 * kCell));
  const std::uint64_t one = make(scene).hash();
  scene.fixes[0] = left_of(-kLength / 2 + 3.6 * kCell);
  EXPECT_NE(make(scene).hash(), one);
}

/// The greatest distance from their places at rest of what lies left of x, m, and of all.
struct Moved {
  double held = 0, all = 0;
};
template <class Rest, class Now>
Moved moved(const Rest& rest, const Now& now, double x) {
  Moved out;
  for (std::size_t i = 0; i < now.size(); ++i) {
    const double way = norm(now[i] - rest[i]);
    out.all = std::max(out.all, way);
    if (rest[i].x <= x) out.held = std::max(out.held, way);
  }
  return out;
}

// Nodes of a cell that a border crosses move with what is free of it, and held vertices went with them.
TEST(HeldMaterial, ItStaysWhereItIsHeld) {
  for (const double share : {0.02, 0.4, 0.98}) {
    Scene scene = strip(1e6);
    const double border = -kLength / 2 + kCell * (3 + share);
    scene.body.options.visual_triangles = 3000;
    scene.fixes.push_back(left_of(border));
    Session session = make(scene);
    const auto look = [&](const char* when) {
      const CellComplex& complex = session.body().complex;
      const Moved skin = moved(complex.visual.rest.raw(), session.visual_positions(), border),
                  middle = moved(complex.collision.rest.raw(), session.collision_positions(), border);
      EXPECT_LT(skin.held, 1e-16) << when << share;
      EXPECT_LT(middle.held, 1e-16) << when << share;
      std::vector<Vec3f> positions, normals;
      session.visual_skin(positions, normals);
      std::vector<Vec3> drawn;
      for (const Vec3f p : positions) drawn.push_back(to_double(p));
      EXPECT_LT(moved(complex.visual.rest.raw(), drawn, border).held, 1e-8) << when << share;
      const std::vector<Vec3> velocities = session.visual_velocities();
      for (std::size_t i = 0; i < velocities.size(); ++i)
        EXPECT_TRUE(complex.visual.rest.raw()[i].x > border || norm(velocities[i]) == 0) << when << share;
      return skin.all;
    };
    for (int i = 0; i < 30; ++i) ASSERT_TRUE(session.step().ok());
    EXPECT_GT(look("bent "), 0.02);
    ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, true).ok());
    for (const double x : {-0.12, -0.05}) ASSERT_TRUE(session.move_blade({x, 0.001, 0.01}, {x, 0.001, -0.01}).ok());
    ASSERT_TRUE(session.end_stroke().ok());
    look("cut ");
    for (int i = 0; i < 10; ++i) ASSERT_TRUE(session.step().ok());
    look("cut and bent ");
    ASSERT_TRUE(session.undo().ok());
    look("whole again ");
    const auto kept = session.snapshot();
    for (int i = 0; i < 5; ++i) ASSERT_TRUE(session.step().ok());
    session.restore(kept);
    look("restored ");
  }
}

TEST(HeldMaterial, NothingJumpsAsItIsLetGo) {
  Scene scene = strip(1e6);
  scene.body.options.visual_triangles = 3000;
  scene.fixes.push_back(left_of(-kLength / 2 + 3.4 * kCell));
  Session session = make(scene);
  for (int i = 0; i < 30; ++i) ASSERT_TRUE(session.step().ok());
  const std::vector<Vec3> skin = session.visual_positions(), middle = session.collision_positions();
  SceneCommand command;
  command.what = SceneUnfix{left_of(-kLength / 2 + 3.4 * kCell).region};
  ASSERT_TRUE(session.apply(command).ok());
  EXPECT_LT(moved(skin, session.visual_positions(), 1).all, 1e-15);
  EXPECT_LT(moved(middle, session.collision_positions(), 1).all, 1e-15);
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(session.step().ok());
  EXPECT_TRUE(session.fading_visual().empty());
}

/// A probe is led down onto the strip, beside its border; both ends of it are held, and it weighs nothing.
Session pressed_by_a_probe(double share, double x_of_border) {
  Scene scene = strip(1e6);
  scene.simulation.gravity = {};
  scene.simulation.tolerance = 1e-9;
  scene.simulation.time_step = 0.005;
  const double border = -kLength / 2 + kCell * (5 + share);
  scene.fixes.push_back(left_of(border));
  SceneRigidTool tool;
  tool.id = "tool";
  tool.kind = SceneToolKind::kProbe;
  tool.position = {border + x_of_border, 0.001, 0.01};
  tool.mass = 0.05;
  tool.stiffness = 500;
  tool.max_force = 0;
  scene.tools = {tool};
  SceneCommand command;
  command.what = SceneToolMotion{"tool", {{0.3, {border + x_of_border, 0.001, -0.002}, {}}}};
  scene.commands.push_back(command);
  Session session = make(scene);
  for (int i = 0; i < 200; ++i) EXPECT_TRUE(session.step().ok());
  return session;
}

// What presses on held material meets what does not give way, supports take its force, and what is free beside it does not feel it.
TEST(HeldMaterial, WhatPressesOnItIsHeld) {
  for (const double share : {0.4, 0.9}) {
    Session session = pressed_by_a_probe(share, -0.016);
    const double push = session.tools()[0].force.z;
    EXPECT_GT(push, 0.5) << share;
    EXPECT_NEAR(session.support_force().z, push, 1e-6) << share;
    EXPECT_LT(moved(session.body().complex.collision.rest.raw(), session.collision_positions(), 1).all, 1e-16) << share;
  }
}

TEST(HeldMaterial, WhatIsHeldByALineIsNoted) {
  for (const bool line : {true, false}) {
    Scene scene = strip(1e6);
    SceneFix fix;
    fix.region.min = {-kLength / 2 - 1e-6, -1, line ? -kThickness / 2 - 1e-6 : -1};
    fix.region.max = {-kLength / 2 + 1e-6, 1, line ? -kThickness / 2 + 1e-6 : 1};
    scene.fixes.push_back(fix);
    const Session session = make(scene);
    EXPECT_EQ(std::any_of(session.notes().begin(), session.notes().end(),
                          [](const std::string& note) { return note.find("can turn about that line") != note.npos; }),
              line);
  }
}

}  // namespace
}  // namespace kerf::held_material_test
