// Whole scenes against what theory or another program says of them: right values, and how far off Kerf once was.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "kerf/session/session.h"
#include "session/make_session.h"

namespace kerf::truth_test {
namespace {

using test::make;

constexpr double kDegrees = 180 / M_PI;

/// A closed slab in the middle of the origin, and a lattice along its sides.
Scene slab(Vec3 size, Vec3 cell, double young, double poisson) {
  Scene scene;
  scene.body.model = "closed-sheet";
  scene.body.size = size;
  scene.body.options.visual_triangles = 2000;
  scene.body.options.collision_triangles = 162;
  scene.material.young = young;
  scene.material.poisson = poisson;
  scene.material.density = 1000;
  scene.material.damping_stiffness = 0;
  scene.lattice.origin = -0.5 * size;
  scene.lattice.cell_size = cell;
  scene.lattice.cells.emplace();
  for (int a = 0; a < 3; ++a)
    (*scene.lattice.cells)[static_cast<std::size_t>(a)] = static_cast<int>(std::lround(size[a] / cell[a]));
  return scene;
}
SceneFix in_box(Vec3 min, Vec3 max) {
  SceneFix fix;
  fix.region.min = min;
  fix.region.max = max;
  return fix;
}
SceneFix left_of(double x) {
  SceneFix fix;
  fix.region.shape = SceneRegion::Shape::kHalfSpace;
  fix.region.point = {x, 0, 0};
  fix.region.normal = {-1, 0, 0};
  return fix;
}
SceneObstacle box(Vec3 size, Vec3 position) {
  SceneObstacle out;
  out.shape = SceneShape::kBox;
  out.size = size;
  out.position = position;
  return out;
}
void run(Session& session, double seconds) {
  for (int i = 0; i < static_cast<int>(std::lround(seconds / session.time_step())); ++i) {
    const auto done = session.step();
    ASSERT_TRUE(done.ok()) << done.error().message;
  }
}
/// The mean of the places of those collision vertices that `asked` says.
Vec3 mean(Session& session, const std::function<bool(Vec3)>& asked) {
  const std::vector<Vec3>& rest = session.body().complex.collision.rest.raw();
  Vec3 sum;
  int count = 0;
  for (std::size_t i = 0; i < rest.size(); ++i)
    if (asked(rest[i])) sum += session.collision_positions()[i], ++count;
  EXPECT_GT(count, 0);
  return (1.0 / count) * sum;
}

// A rigid rod on a hinge, exactly and by implicit Euler at this step, has turned by 88 to 91 degrees. It had turned by 57.
TEST(Truth, AStiffStripHangsByTheEdgeOfItsEnd) {
  Scene scene = slab({0.1, 0.02, 0.005}, {0.005, 0.005, 0.005}, 5e6, 0.4);
  scene.material.damping_mass = 0;
  scene.simulation.time_step = 0.005;
  scene.fixes.push_back(in_box({-0.051, -0.02, -0.0026}, {-0.049999, 0.02, -0.00249}));
  Session session = make(scene);
  run(session, 0.15);
  const Vec3 end = mean(session, [](Vec3 x) { return x.x > 0.05 - 1e-6; }) - Vec3{-0.05, 0, -0.0025};
  const double turned = std::atan2(-end.z, end.x) * kDegrees;
  EXPECT_GT(turned, 78);
  EXPECT_LT(turned, 100);
}

// Its middle lies 10 mm beyond the edge of a box. In steps of 0.5 ms it turns by 108 degrees. It had turned by 23.
TEST(Truth, AStiffStripTipsOverAnEdge) {
  Scene scene = slab({0.1, 0.02, 0.005}, {0.005, 0.005, 0.005}, 4e6, 0.4);
  scene.material.damping_stiffness = SceneMaterial().damping_stiffness;
  scene.simulation.time_step = 0.0167;
  scene.obstacles.push_back(box({0.2, 0.2, 0.1}, {-0.11, 0, -0.0525}));
  scene.obstacles[0].friction = 0.5;
  Session session = make(scene);
  run(session, 0.2505);
  const Vec3 along = mean(session, [](Vec3 x) { return x.x > 0.05 - 1e-6; }) -
                     mean(session, [](Vec3 x) { return x.x < -0.05 + 1e-6; });
  const double turned = std::atan2(-along.z, along.x) * kDegrees;
  EXPECT_GT(turned, 75);
  EXPECT_LT(turned, 140);
}

/// A slab of 40 x 20 x 3 mm, squeezed by a tenth between a plane and a box.
Scene squeezed_slab(const Vec3& cell, int layers) {
  Scene scene = slab({0.04, 0.02, 0.003}, cell, 1e5, 0.4);
  if (layers > 0) {
    scene.lattice = {};
    scene.lattice.layers = layers;
  }
  scene.material.damping_mass = 5;
  scene.material.damping_stiffness = 0.002;
  scene.simulation.time_step = 0.004;
  scene.obstacles.push_back(box({0.06, 0.04, 0.02}, {0, 0, 0.0116}));
  ScenePose down;
  down.time = 0.2;
  down.position = {0, 0, 0.0112};
  scene.obstacles[0].moves = {down};
  SceneObstacle plane;
  plane.shape = SceneShape::kPlane;
  plane.position = {0, 0, -0.0015};
  scene.obstacles.push_back(plane);
  return scene;
}
/// N with which the box is pressed.
double press(Session& session) {
  run(session, 0.6);
  double force = 0;
  for (const Session::ContactState& c : session.contacts())
    if (c.obstacle == 0) force += c.normal_force;
  return force;
}
/// It presses with 8.0 N with free sides, and 11.96 N where faces stick (CalculiX). Cells of one layer can't bulge between plates that grip: those of 1 x 1 x 3 mm come to 14.4 N,
/// which is the lattice's, not contact's.
void expect_squeezed(const Vec3& cell, int layers) {
  Session session = make(squeezed_slab(cell, layers));
  const double force = press(session);
  double deepest = 0;
  for (const Vec3 x : session.visual_positions()) deepest = std::max({deepest, x.z - 0.0012, -0.0015 - x.z});
  EXPECT_GT(force, 8.0) << layers;
  EXPECT_LT(force, 14.4) << layers;
  EXPECT_LT(deepest, 0.05 * 0.0015) << layers;
}

// It had pressed with 6.9 and 5.2 N.
TEST(Truth, ASlabOfSeveralLayersPressesBack) {
  for (const int layers : {1, 2, 3}) expect_squeezed({1, 1, 1}, layers);
}
// It had pressed with 0.5 N.
TEST(Truth, ASlabOfCoarseCollisionTrianglesPressesBack) { expect_squeezed({0.002, 0.002, 0.003}, 0); }

// Points of sides were chosen by a mean over all bodies: a large sheet of one layer left a slab of two without them, at half of its force.
TEST(Truth, ASlabOfSeveralLayersPressesBackBesideALargeSheet) {
  Scene scene = squeezed_slab({1, 1, 1}, 1);
  scene.lattice = {};
  scene.lattice.cell_size = Vec3{0.004, 0.004, 0.0015};
  scene.simulation.gravity = {};
  Session one = make(scene);
  SceneBody& sheet = scene.more_bodies.emplace_back(scene.body);
  sheet.size = Vec3{0.12, 0.12, 0.0015};
  sheet.position = {0, 0, 1};
  Session both = make(scene);
  const double alone = press(one), beside = press(both);
  EXPECT_GT(alone, 8.0);
  EXPECT_NEAR(beside, alone, 0.01 * alone);
}

// A 22nd of a cell lies in a second layer. The tip goes down by 0.0490 lengths (CalculiX, geometrically nonlinear). It had gone down by 0.0561.
TEST(Truth, ASliverOfALayerBendsAsABeam) {
  Scene scene = slab({0.1, 0.02, 0.005}, {0.005, 0.005, 0.005}, 1.1772e7, 0.3);
  scene.lattice.origin = Vec3{-0.05, -0.01, -0.002725};
  scene.lattice.cells = std::array<int, 3>{20, 4, 2};
  scene.material.damping_mass = 35;
  scene.simulation.time_step = 0.004;
  scene.simulation.preconditioner = ScenePreconditioner::kDirect;
  scene.fixes.push_back(left_of(-0.05 + 1e-6));
  Session session = make(scene);
  run(session, 0.6);
  const Vec3 tip = mean(session, [](Vec3 x) { return x.x > 0.05 - 1e-6; });
  EXPECT_NEAR(-tip.z / 0.1, 0.0490, 0.03 * 0.0490);
}

// A force acts half a millimetre beside a slit along y = 0. The other lip had moved most.
TEST(Truth, ALoadPullsTheLipThatItIsOn) {
  Scene scene = slab({0.04, 0.04, 0.004}, {0.004, 0.004, 0.004}, 1e5, 0.3);
  scene.body.options.collision_triangles = 800;
  scene.material.damping_mass = 40;
  scene.simulation.time_step = 0.004;
  scene.simulation.gravity = {};
  scene.contact.enabled = false;
  scene.fixes.push_back(left_of(-0.019999));
  SceneLoad load;
  load.point = {0.02, 0.0005, 0};
  load.force = {0, 0.002, 0};
  scene.loads.push_back(load);
  Session session = make(scene);
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, false).ok());
  for (const double x : {0.023, 0.004}) ASSERT_TRUE(session.move_blade({x, 0, 0.01}, {x, 0, -0.01}).ok());
  ASSERT_TRUE(session.end_stroke().ok());
  run(session, 0.8);
  const CollisionMesh& mesh = session.body().complex.collision;
  double left = 0, right = 0;  // of the lips' corners on the rim: how far they have moved
  for (const CollisionTriangle t : ids<CollisionTriangle>(mesh.face_count())) {
    Vec3 middle;
    for (int k = 0; k < 3; ++k) middle += (1.0 / 3) * mesh.rest[mesh.origin[CollisionMesh::corner(t, k)]];
    for (int k = 0; k < 3; ++k) {
      const CollisionVertex v = mesh.origin[CollisionMesh::corner(t, k)];
      if (norm(mesh.rest[v] - Vec3{0.02, 0, 0}) > 1e-6) continue;
      (middle.y > 0 ? left : right) = norm(session.collision_positions()[v.index()] - mesh.rest[v]);
    }
  }
  EXPECT_GT(left, 3 * right);
  EXPECT_GT(right, 0);
}

}  // namespace
}  // namespace kerf::truth_test
