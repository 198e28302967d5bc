// Friction across cuts: what rests by friction does not creep when it is cut.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "kerf/session/session.h"

namespace kerf::friction_memory_test {
namespace {

/// A slab on a plane that is tilted to `slope` about y, by turning gravity instead.
Scene slab_on_slope(double time_step, double slope) {
  Scene scene;
  scene.body.model = "steak";
  scene.body.options.visual_triangles = 0;
  scene.body.position = {0, 0, 0.02};
  scene.material.damping_mass = 4;
  scene.simulation.time_step = time_step;
  const double g = 9.81 / std::sqrt(1 + slope * slope);
  scene.simulation.gravity = {slope * g, 0, -g};
  SceneObstacle ground;
  ground.shape = SceneShape::kPlane;
  ground.friction = 0.3;
  scene.obstacles = {ground};
  return scene;
}

struct Creep {
  double mean = 0, most = 0;  ///< m along the slope, of the vertices that there were: down; either way, any of them
};
Creep creep_of(Session& session, const std::vector<Vec3>& before) {
  const std::vector<Vec3>& x = session.collision_positions();
  Creep creep;
  for (std::size_t v = 0; v < before.size(); ++v) {
    creep.mean += (x[v].x - before[v].x) / static_cast<double>(before.size());
    creep.most = std::max(creep.most, std::fabs(x[v].x - before[v].x));
  }
  return creep;
}

/// Where a cut makes new vertices, contacts start with unstretched friction springs. A spring holds with mu times the normal force, and its
/// stiffness is that of the overlap: so its stretch is mu times the overlap at most, and that is all a cut may let the slab creep.
TEST(FrictionMemory, WhatRestsDoesNotCreepWhenItIsCut) {
  struct Row {
    double slope, dt;
  };
  for (const Row row : {Row{0.29, 0.004}, Row{0.29, 0.0167}, Row{0.1, 0.0167}}) {
    const double dt = row.dt;
    auto made = Session::create(slab_on_slope(dt, row.slope));
    ASSERT_TRUE(made.ok()) << made.error().message;
    Session session = std::move(*made);
    const auto wait = [&](double s) { ASSERT_TRUE(session.step(static_cast<int>(std::ceil(s / dt))).ok()); };
    wait(1.5);
    std::vector<Vec3> before = session.collision_positions();
    wait(0.5);
    EXPECT_LT(creep_of(session, before).most, 1e-12) << dt << ": it rests";
    before = session.collision_positions();
    double overlap = 0;
    for (const Session::ContactState& c : session.contacts()) overlap = std::max(overlap, -c.gap);
    ASSERT_GT(overlap, 0);
    constexpr int kCuts = 20;
    for (int i = 0; i < kCuts; ++i) {
      // Short cuts to both sides; every fifth goes in from the border.
      const double y = i % 5 == 4 ? -0.1 : -0.03 + 0.003 * i, at = -0.04 + 0.004 * i;
      const Vec3 way = i % 5 == 4 ? Vec3{0, 0.015, 0} : Vec3{0.003, 0, 0};
      ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, false).ok());
      for (int k = 0; k <= 4; ++k) {
        const Vec3 p = Vec3{at, y, 0} + static_cast<double>(k) * way;
        ASSERT_TRUE(session.move_blade(p + Vec3{0, 0, 0.1}, p - Vec3{0, 0, 0.1}).ok());
      }
      ASSERT_TRUE(session.end_stroke().ok());
      wait(0.1);
    }
    wait(0.3);
    EXPECT_GT(session.body().complex.collision.face_count(), 200u);
    const Creep creep = creep_of(session, before);
    EXPECT_LT(std::fabs(creep.mean), kCuts * 0.3 * overlap) << dt;
    double speed = 0;
    for (const Vec3 v : session.node_velocities()) speed = std::max(speed, norm(v));
    EXPECT_LT(speed, 1e-4) << dt << ": and it rests again";
  }
}

}  // namespace
}  // namespace kerf::friction_memory_test
