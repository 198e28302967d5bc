// Bodies of a scene that are stretched at rest.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>

#include "kerf/session/session.h"
#include "session/make_session.h"

namespace kerf::gaping_test {
namespace {

using test::make;

/// A sheet under equal prestretch, held all round: a hole opens as Lame's ring between the hole and what holds it.
TEST(SessionPrestretch, AHoleOpensAsLameSays) {
  Scene scene;
  scene.body.model = "closed-sheet";
  scene.body.options.visual_triangles = 8000;
  scene.body.options.collision_triangles = 1250;
  scene.body.size = Vec3{0.2, 0.2, 0.004};
  const double stretch = 1.02, poisson = 0.3, hole = 0.02, rim = 0.1;
  scene.body.material.young = 1e5;
  scene.body.material.poisson = poisson;
  scene.body.material.density = 1000;
  scene.body.material.prestretch = Vec3{stretch, stretch, 1};
  scene.material.damping_mass = 5;
  scene.lattice.cells = std::array<int, 3>{40, 40, 1};
  scene.simulation.gravity = {};
  scene.simulation.time_step = 0.01;
  for (const Vec3 out : {Vec3{1, 0, 0}, Vec3{-1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, -1, 0}}) {
    SceneFix& fix = scene.fixes.emplace_back();
    fix.region.shape = SceneRegion::Shape::kHalfSpace;
    fix.region.point = 0.0999 * out;
    fix.region.normal = out;
  }
  Session session = make(scene);
  ASSERT_TRUE(session.step(3).ok());
  SceneCommand command;
  ScenePunch punch;
  punch.radius = hole;
  command.what = punch;
  ASSERT_TRUE(session.apply(command).ok());
  ASSERT_TRUE(session.step(150).ok());
  const CollisionMesh& mesh = session.body().complex.collision;
  const std::vector<Vec3>& now = session.collision_positions();
  double open = 0, shrunk = 0;
  int of_hole = 0, of_disc = 0;
  for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(mesh.origin.size())) {
    const CollisionVertex v = mesh.from(h);
    const double r = std::hypot(mesh.rest[v].x, mesh.rest[v].y);
    if (!mesh.is_lip(h) || std::abs(r - hole) > 0.02 * hole) continue;
    const double out = std::hypot(now[v.index()].x, now[v.index()].y) - r;
    if (out > 0) open += out, ++of_hole;  // the disc moves the other way
    else shrunk += out, ++of_disc;
  }
  ASSERT_GT(of_hole, 8);
  open /= of_hole;
  shrunk /= of_disc;
  const double strain = 1 - 1 / stretch;
  const double b = (1 + poisson) * strain / ((1 + poisson) / (rim * rim) + (1 - poisson) / (hole * hole));
  const double want = b * (1 / hole - hole / (rim * rim));
  RecordProperty("over_theory", std::to_string(open / want));
  EXPECT_NEAR(open / want, 1, 0.05);
  EXPECT_NEAR(shrunk / (-hole * strain), 1, 0.03);
}

}  // namespace
}  // namespace kerf::gaping_test
