// Cuts of a moving body: the surface goes on as it moved, and what keeps it there is mostly kept by node.
#include "kerf/session/surface_fade.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "session/continuity.h"

namespace kerf::surface_fade_test {
namespace {

// A critically damped spring from x0 with speed v0: x = (x0 + (v0 + r x0) t) exp(-r t).
TEST(NodeFade, FadesLikeACriticallyDampedSpring) {
  const Vec3 x0{1, -2, 0.5}, v0{-30, 10, 400};
  SurfaceFade fade;
  fade.nodes.set(NodeId(3), x0, v0);
  fade.visual.push_back({7, x0, v0});
  double t = 0;
  for (const double dt : {0.001, 0.005, 0.0007, 0.02}) {
    fade_offsets(fade, dt, 1e-9);
    t += dt;
    const double e = std::exp(-kFadeRate * t);
    const Vec3 x = e * (x0 + t * (v0 + kFadeRate * x0)), v = e * (v0 + kFadeRate * x0) - kFadeRate * x;
    EXPECT_LT(norm(fade.nodes.offset_of(NodeId(3)) - x), 1e-13);
    EXPECT_LT(norm(fade.nodes.velocity_of(NodeId(3)) - v), 1e-11);
    ASSERT_EQ(fade.visual.size(), 1u);
    EXPECT_EQ(fade.visual[0].offset, fade.nodes.offset_of(NodeId(3)));
  }
  EXPECT_EQ(fade.nodes.offset_of(NodeId(2)), Vec3{});
  EXPECT_EQ(fade.nodes.offset_of(NodeId(9)), Vec3{});
  for (int i = 0; i < 30; ++i) fade_offsets(fade, 0.01, 1e-9);
  EXPECT_TRUE(fade.empty());
}

/// A sheet of rubber whose fine mesh has many vertices in every cell is pulled, let go, and cut while it swings.
Session swinging_sheet() {
  Scene scene;
  scene.body.model = "sheet";
  scene.body.options.visual_triangles = 26624;
  scene.material.young = 20e3;
  scene.material.poisson = 0.4;
  scene.material.density = 1000;
  scene.simulation.gravity = {0, 0, 0};
  scene.simulation.time_step = 0.002;
  auto session = Session::create(scene);
  EXPECT_TRUE(session.ok());
  SceneGrasp grasp;
  grasp.id = "g";
  grasp.point = {0.4, 0.4, 0};
  grasp.radius = 0.2;
  SceneMove move;
  move.id = "g";
  move.by = Vec3{0.2, 0.1, 0.3};
  move.over = 0.05;
  EXPECT_TRUE(session->apply({0, grasp}).ok());
  EXPECT_TRUE(session->apply({0, move}).ok());
  EXPECT_TRUE(session->step(25).ok());
  EXPECT_TRUE(session->apply({0, SceneRelease{"g"}}).ok());
  EXPECT_TRUE(session->step(5).ok());
  return std::move(session).value();
}

// The cost of a pose goes with what it changes: of the vertices in the cells around the cut, whose nodes are given other velocities, only
// those that change their hexahedron may have an offset of their own.
TEST(SurfaceFade, ACutOfAMovingBodyIsLocal) {
  Session session = swinging_sheet();
  const std::size_t all = session.body().complex.visual.vertex_count();
  std::size_t most = 0, poses = 0, nodes_beside = 0;
  std::vector<Vec3> shown;
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, true).ok());
  for (int i = 0; i <= 40; ++i) {
    const double x = -0.6 + 0.03 * i, y = 0.13 + 0.1 * std::sin(0.2 * i);
    const test::SurfaceMotion before = test::surface_motion(session);
    ASSERT_TRUE(session.move_blade({x, y, 1}, {x, y, -1}).ok());
    const test::Continuity c = test::continuity(before, test::surface_motion(session), 1.4);
    ASSERT_TRUE(c.broken.empty()) << c.broken << ", pose " << i;
    most = std::max(most, session.fading_visual().size());
    session.shown_nodes(shown);
    std::size_t beside = 0;
    for (std::size_t n = 0; n < shown.size(); ++n) beside += shown[n] != session.node_positions()[n] ? 1 : 0;
    nodes_beside = std::max(nodes_beside, beside);
    poses += session.strokes().back().triangles > 0 ? 1 : 0;
    ASSERT_TRUE(session.step(2).ok());
  }
  ASSERT_TRUE(session.end_stroke().ok());
  std::printf("%zu of %zu vertices and %zu of %zu nodes beside their place at most\n", most, all, nodes_beside,
              shown.size());
  EXPECT_GT(poses, 20u);
  EXPECT_GT(nodes_beside, 10u);
  EXPECT_LT(most, all / 6);
  ASSERT_TRUE(session.step(100).ok());
  EXPECT_TRUE(session.fading_visual().empty());
  session.shown_nodes(shown);
  EXPECT_EQ(shown, session.node_positions());
}

// A support takes hold at once, not with the next step: what a cut lets go there must not bring back the motion from before.
TEST(SurfaceFade, ASupportOfAMovingBodyHoldsWhatIsCutAtOnce) {
  Session session = swinging_sheet();
  const auto stroke = [&](double y, double from, double to) {
    ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, true).ok());
    for (int i = 0; i <= 10; ++i) {
      const double x = from + (to - from) * i / 10;
      const test::SurfaceMotion before = test::surface_motion(session);
      ASSERT_TRUE(session.move_blade({x, y, 1}, {x, y, -1}).ok());
      const test::Continuity c = test::continuity(before, test::surface_motion(session), 1.4);
      ASSERT_TRUE(c.broken.empty()) << c.broken << ", pose " << i;
    }
    ASSERT_TRUE(session.end_stroke().ok());
  };
  stroke(-0.21, -0.6, 0.1);
  const double moving = test::surface_motion(session).kinetic;
  SceneFixCommand fix;
  fix.region.shape = SceneRegion::Shape::kSphere;
  fix.region.center = {0, 0.13, 0};
  fix.region.radius = 0.3;
  ASSERT_TRUE(session.apply({0, fix}).ok());
  const Status held = session.validate();
  ASSERT_TRUE(held.ok()) << held.error().message;
  EXPECT_LT(test::surface_motion(session).kinetic, moving);
  stroke(0.13, -0.6, 0.1);
  // Undo brings the motion of before back, but not to what is held since.
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(session.undo().ok());
    const Status valid = session.validate();
    ASSERT_TRUE(valid.ok()) << valid.error().message;
  }
}

// Offsets of nodes belong to what undo, redo, snapshots and cancelled strokes take back.
TEST(SurfaceFade, UndoTakesOffsetsBack) {
  Session session = swinging_sheet();
  const auto cut = [&](double y) {
    ASSERT_TRUE(session.begin_stroke(SceneFrame::kWorld, true).ok());
    for (int i = 0; i <= 6; ++i) {
      ASSERT_TRUE(session.move_blade({-0.3 + 0.07 * i, y, 2}, {-0.3 + 0.07 * i, y, -2}).ok());
      ASSERT_TRUE(session.step(1).ok());
    }
  };
  cut(-0.1);
  ASSERT_TRUE(session.end_stroke().ok());
  std::vector<Vec3> shown;
  session.shown_nodes(shown);
  ASSERT_NE(shown, session.node_positions());
  const std::uint64_t hash = session.hash();
  const auto snapshot = session.snapshot();
  cut(0.17);
  ASSERT_NE(session.hash(), hash);
  ASSERT_TRUE(session.end_stroke().ok());
  const std::vector<Vec3> after = session.visual_positions();
  ASSERT_TRUE(session.undo().ok());
  std::vector<Vec3> again;
  session.shown_nodes(again);
  EXPECT_EQ(again, shown);
  ASSERT_TRUE(session.redo().ok());
  EXPECT_EQ(session.visual_positions(), after);
  session.restore(snapshot);
  EXPECT_EQ(session.hash(), hash);
}

}  // namespace
}  // namespace kerf::surface_fade_test
