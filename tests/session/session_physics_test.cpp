// What a cut may not do to the motion: mass, momentum and energy across cuts, and how a body gives way as a slit grows.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "kerf/session/body_mechanics.h"
#include "kerf/session/session.h"
#include "session/make_session.h"

namespace kerf::session_physics_test {
namespace {

using test::make;

struct Motion {
  double mass = 0, kinetic = 0;
  Vec3 momentum;
};

/// From a mechanical model of the hexahedra as they are now, made anew.
Motion motion_of(const Session& session, SceneMaterial material) {
  Motion m;
  BodyMaterials materials;
  const HexMesh& hex = session.body().hex;
  auto model = make_mechanics(hex, material, SceneFormulation::kIncompatible, materials);
  EXPECT_TRUE(model.ok());
  MechanicsState state;
  EXPECT_TRUE(sync_all(hex, materials, *model, state).ok());
  for (const NodeId n : ids<NodeId>(hex.node_count())) {
    if (!hex.active(n)) continue;
    const double mass = model->node_mass(n);
    const Vec3 v = session.node_velocities()[n.index()];
    m.mass += mass;
    m.momentum += mass * v;
    m.kinetic += 0.5 * mass * dot(v, v);
  }
  return m;
}

/// A free body is pulled out of shape and let go; it is cut in flight, and no time passes during the cuts.
TEST(CutPhysics, MassMomentumAndEnergyInTheFrameOfACut) {
  for (const char* name : {"closed-sheet", "steak", "tube"}) {
    Scene scene;
    scene.name = name;
    scene.body.model = name;
    if (scene.body.model != "steak") scene.body.options.visual_triangles = 1000;
    scene.material.young = 20e3;
    scene.material.poisson = 0.4;
    scene.material.density = 1000;
    scene.material.damping_mass = 0;
    scene.simulation.gravity = {0, 0, 0};
    scene.simulation.time_step = 0.002;
    Session session = make(scene);
    Box3 box;
    for (const Vec3 p : session.collision_positions()) box.add(p);
    const double size = box.diagonal();
    SceneGrasp grasp;
    grasp.id = "g";
    grasp.point = box.max;
    grasp.radius = 0.2 * size;
    SceneMove move;
    move.id = "g";
    move.by = Vec3{0.05 * size, -0.02 * size, 0.2 * size};
    move.over = 0.05;
    ASSERT_TRUE(session.apply({0, grasp}).ok());
    ASSERT_TRUE(session.apply({0, move}).ok());
    ASSERT_TRUE(session.step(25).ok());
    ASSERT_TRUE(session.apply({0, SceneRelease{"g"}}).ok());
    ASSERT_TRUE(session.step(5).ok());

    double worst_momentum = 0, worst_energy = 0;
    for (int cut = 0; cut < 4; ++cut) {
      const Motion before = motion_of(session, scene.material);
      const Vec3 c = box.center(), s = box.size();
      const double x = c.x + s.x * (-0.35 + 0.2 * cut), up = 3 * size;
      ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, true).ok());
      for (int i = 0; i <= 10; ++i) {
        const double y = c.y + s.y * (-0.7 + (cut % 2 ? 1.0 : 1.4) * i / 10);
        ASSERT_TRUE(session.move_blade({x, y, c.z + up}, {x + 0.1 * s.x, y, c.z - up}).ok());
      }
      ASSERT_TRUE(session.end_stroke().ok());
      ASSERT_GT(session.strokes().back().triangles, 0) << name;
      const Motion after = motion_of(session, scene.material);
      EXPECT_NEAR(after.mass, before.mass, 1e-12 * before.mass) << name;
      const double scale = std::sqrt(2 * before.kinetic * before.mass);
      worst_momentum = std::max(worst_momentum, norm(after.momentum - before.momentum) / scale);
      worst_energy = std::max(worst_energy, after.kinetic / before.kinetic - 1);
      ASSERT_TRUE(session.step(3).ok());
    }
    std::printf("%s: in a cut momentum changes by up to %.2g of its scale, kinetic energy by up to %.2g\n", name,
                worst_momentum, worst_energy);
    EXPECT_LT(worst_momentum, 1e-9) << name;
    EXPECT_LT(worst_energy, 1e-9) << name;
  }
}

/// Without anything that holds or pulls it, a body's momentum stays through steps and cuts.
TEST(CutPhysics, AFreeBodyKeepsItsMomentum) {
  Scene scene;
  scene.body.model = "steak";
  scene.material.young = 20e3;
  scene.material.poisson = 0.4;
  scene.material.density = 1000;
  scene.material.damping_mass = 0;
  scene.simulation.gravity = {0.3, 0, -1};
  scene.simulation.time_step = 0.002;
  scene.simulation.tolerance = 1e-8;
  Session session = make(scene);
  double worst = 0;
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, false).ok());
  for (int i = 0; i <= 60; ++i) {
    const double y = -0.11 + 0.0025 * i;
    ASSERT_TRUE(session.move_blade({0.01, y, 0.3}, {0.012, y, -0.3}).ok());
    ASSERT_TRUE(session.step(1).ok());
    const Motion m = motion_of(session, scene.material);
    worst =
        std::max(worst, norm((1 / m.mass) * m.momentum - session.time() * scene.simulation.gravity) / session.time());
  }
  ASSERT_GT(session.strokes().back().triangles, 10);
  EXPECT_LT(worst, 1e-6);  // of about 1 m/s2
}

/// A sheet held along one side is slit from the other; a pair of forces opens the lips, statics at every length.
TEST(CutPhysics, ComplianceGrowsSmoothlyWithASlit) {
  Scene scene;
  scene.body.model = "sheet";
  scene.body.options.visual_triangles = 1664;
  scene.material.young = 5e3;
  scene.material.damping_mass = 0;
  scene.material.damping_stiffness = 0;
  scene.simulation.gravity = {0, 0, 0};
  scene.simulation.time_step = 1e4;  // no inertia is left
  scene.simulation.preconditioner = ScenePreconditioner::kDirect;
  SceneFix fix;
  fix.region.shape = SceneRegion::Shape::kHalfSpace;
  fix.region.point = {-0.45, 0, 0};
  fix.region.normal = {-1, 0, 0};
  scene.fixes.push_back(fix);
  const double y0 = 0.013;
  CollisionVertex above, below;
  double gap = 0;
  {
    Session probe = make(scene);
    const auto& rest = probe.collision_positions();
    for (std::size_t i = 0; i < rest.size(); ++i) {
      if (rest[i].x < 0.499) continue;
      const CollisionVertex v(i);
      if (rest[i].y > y0 && (!above.valid() || rest[i].y < rest[above.index()].y)) above = v;
      if (rest[i].y < y0 && (!below.valid() || rest[i].y > rest[below.index()].y)) below = v;
    }
    ASSERT_TRUE(above.valid() && below.valid());
    const double force = 1e-3;
    gap = rest[above.index()].y - rest[below.index()].y;
    scene.loads.push_back({rest[above.index()], 0, {0, force, 0}, 0, {}});
    scene.loads.push_back({rest[below.index()], 0, {0, -force, 0}, 0, {}});
  }
  Session session = make(scene);
  const double cell = session.body().hex.bodies[0].frame.cell.x, first = 0.5 - 0.2 * cell;
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, false).ok());
  ASSERT_TRUE(session.move_blade({0.6, y0, 1}, {0.6, y0, -1}).ok());
  double before = 0, worst = 0, least = 1, at = 0;
  std::printf("cells slit, opening per force (m/N):");
  for (int i = 0; first - i * cell / 20 > -0.2; ++i) {
    const double x = first - i * cell / 20;
    ASSERT_TRUE(session.move_blade({x, y0, 1}, {x, y0, -1}).ok());
    ASSERT_TRUE(session.step(2).ok());
    const auto& now = session.collision_positions();
    const double opening = (now[above.index()].y - now[below.index()].y - gap) / 1e-3;
    if (i % 10 == 0) std::printf(" %.2f %.4g;", (0.5 - x) / cell, opening);
    if (i > 0) {
      const double jump = opening / before - 1;
      if (jump > worst) worst = jump, at = (0.5 - x) / cell;
      least = std::min(least, jump);
    }
    before = opening;
  }
  std::printf("\nlargest growth in a twentieth of a cell %.3g (at %.2f cells), least %.3g\n", worst, at, least);
  EXPECT_GT(session.strokes().back().triangles, 0);
  EXPECT_LT(worst, 0.1);
  EXPECT_GT(least, -1e-9);
}

/// Pieces that fall free keep to the fall, however stiff they are for the time step.
TEST(CutPhysics, VeryStiffPiecesDoNotRunAway) {
  for (const double young : {1e9, 1e12}) {
    Scene scene;
    scene.body.model = "steak";
    scene.material.young = young;
    scene.simulation.time_step = 0.1;
    scene.simulation.gravity = {0, 0, -100};
    Session session = make(scene);
    for (const double x : {-0.03, 0.03}) {
      ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, false).ok());
      ASSERT_TRUE(session.move_blade({x, -0.2, 1}, {x, -0.2, -1}).ok());
      ASSERT_TRUE(session.move_blade({x + 0.01, 0.2, 1}, {x + 0.01, 0.2, -1}).ok());
      ASSERT_TRUE(session.end_stroke().ok());
      ASSERT_TRUE(session.step(10).ok());
    }
    EXPECT_EQ(session.counts().pieces, 3);
    double fastest = 0;
    for (const Vec3 v : session.node_velocities()) fastest = std::max(fastest, norm(v));
    EXPECT_LT(fastest, 1.1 * 100 * session.time()) << young << " Pa";
  }
}

}  // namespace
}  // namespace kerf::session_physics_test
