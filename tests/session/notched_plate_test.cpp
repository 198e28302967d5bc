// Plates with a slit, cut by a blade, against another program: statics of the coarse lattice over that of fine 20-node
// bricks. The numbers come from tests/mechanics/notched_plate.py, which says what they are and makes them anew.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "kerf/lattice/tip_glue.h"
#include "kerf/session/body_build.h"
#include "kerf/session/body_mechanics.h"
#include "kerf/session/session.h"

namespace kerf::notched_plate_test {
namespace {

enum Load : std::size_t { kTension, kBending, kOpening, kTearing };
constexpr std::array<const char*, 4> kLoadNames{"tension", "bending", "opening", "tearing"};

struct Row {
  double length, middle;  ///< of the slit, and where it runs; in thicknesses
  std::array<double, 4> compliance;
};

// ccx 2.20 (Debian 12), C3D20R
constexpr Row kReference[] = {
    {0, 0, {0.98535, 379.93, 0, 0}},
    {2, 0, {1.1768, 402.89, 15.097, 97.842}},
    {4, 0, {2.3726, 473.14, 30.188, 338.72}},
    {4.25, 0, {2.6977, 486.71, 32.63, 382.42}},
    {4.5, 0, {3.0923, 501.69, 35.193, 429.38}},
    {4.75, 0, {3.5728, 518.25, 37.873, 479.83}},
    {5, 0, {4.159, 536.53, 40.652, 533.61}},
    {6, 0, {8.2495, 631.85, 52.445, 782.9}},
    {2, 0.5, {1.1848, 399.02, 15.247, 98.024}},
    {4.5, 0.5, {3.2217, 485.09, 36.056, 431.3}},
    {4.75, 0.5, {3.7279, 499.82, 38.851, 482.1}},
    {6, 0.5, {8.5731, 601.89, 54.141, 787.54}},
};

constexpr double kThickness = 0.1, kYoung = 1e4;

Scene plate_scene(int cells, int layers) {
  Scene scene;
  scene.body.model = "closed-sheet";
  scene.body.options.visual_triangles = 8000;
  scene.body.options.collision_triangles = 1500;
  scene.material.young = kYoung;
  scene.material.poisson = 0.3;
  scene.material.density = 1000;
  scene.material.damping_mass = scene.material.damping_stiffness = 0;
  scene.lattice.origin = Vec3{-0.5, -0.5, -0.05};
  scene.lattice.cells = std::array<int, 3>{cells, cells, layers};
  scene.lattice.cell_size = Vec3{1.0 / cells, 1.0 / cells, kThickness / layers};
  return scene;
}

Session cut_plate(const Scene& scene, double length, double middle) {
  auto made = Session::create(scene);
  EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().message);
  Session session = std::move(made).value();
  if (length == 0) return session;
  EXPECT_TRUE(session.begin_stroke(SceneFrame::kRest, false).ok());
  for (const double x : {0.6, 0.5 - length}) EXPECT_TRUE(session.move_blade({x, middle, 1}, {x, middle, -1}).ok());
  EXPECT_TRUE(session.end_stroke().ok());
  // The slit ends where it was meant to.
  double tip = 1;
  const CollisionMesh& mesh = session.body().complex.collision;
  for (const CollisionVertex v : ids<CollisionVertex>(mesh.vertex_count()))
    if (mesh.on_border(v) && std::fabs(mesh.rest[v].y - middle) < 1e-6) tip = std::min(tip, mesh.rest[v].x);
  EXPECT_NEAR(tip, 0.5 - length, 0.02 * kThickness);
  return session;
}

CollisionTriangle triangle_at(const CollisionMesh& mesh, double x, double y) {
  for (const CollisionTriangle t : ids<CollisionTriangle>(mesh.face_count())) {
    bool inside = true;
    for (int i = 0; i < 3; ++i) {
      const Vec3 a = mesh.rest[mesh.origin[CollisionMesh::corner(t, i)]];
      const Vec3 b = mesh.rest[mesh.origin[CollisionMesh::corner(t, (i + 1) % 3)]];
      inside = inside && (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x) >= 0;
    }
    if (inside) return t;
  }
  return {};
}

struct NodeForce {
  NodeId node;
  Vec3 force;
};

/// A force spread evenly over an upright face of the plate, from a to b (z is left out).
void add_traction(const Body& body, Vec3 a, Vec3 b, Vec3 force, std::vector<NodeForce>& forces) {
  constexpr int kAlong = 80, kAcross = 8;
  const Vec3 inwards = 1e-6 * normalized(Vec3{0, 0, 0} - 0.5 * (a + b));
  for (int i = 0; i < kAlong; ++i) {
    Vec3 p = lerp(a, b, (i + 0.5) / kAlong);
    const CollisionTriangle owner = triangle_at(body.complex.collision, p.x + inwards.x, p.y + inwards.y);
    ASSERT_TRUE(owner.valid());
    for (int k = 0; k < kAcross; ++k) {
      p.z = kThickness * ((k + 0.5) / kAcross - 0.5);
      const NodeForces spread =
          spread_force(body.hex, embed_point(body.hex, owner, p), (1.0 / (kAlong * kAcross)) * force);
      for (std::size_t c = 0; c < 8; ++c) forces.push_back({spread.node[c], spread.force[c]});
    }
  }
}

/// Displacement along the load per force, in the reference's units.
double compliance(const Body& body, const Scene& scene, Load load, double middle) {
  BodyMaterials materials;
  auto model = make_mechanics(body.hex, scene.material, SceneFormulation::kIncompatible, materials);
  EXPECT_TRUE(model.ok());
  MechanicsState state;
  EXPECT_TRUE(sync_all(body.hex, materials, *model, state).ok());
  std::vector<TipGlue> glue;
  tip_glue(body.hex, glue);
  for (const TipGlue& g : glue) EXPECT_TRUE(model->add_node_pair(g.a, g.b, g.stiffness_over_e * kYoung).ok());
  const bool lips = load == kOpening || load == kTearing;
  for (const NodeId n : ids<NodeId>(body.hex.node_count()))
    if ((lips ? body.hex.rest(n).x : body.hex.rest(n).y) < -0.5 + 1e-9) model->fix_node(n);

  const Vec3 direction = load == kTension || load == kOpening ? Vec3{0, 1e-3, 0} : Vec3{0, 0, 1e-3};
  std::vector<NodeForce> forces;
  if (lips) {
    add_traction(body, {0.5, middle, 0}, {0.5, middle + kThickness, 0}, direction, forces);
    add_traction(body, {0.5, middle, 0}, {0.5, middle - kThickness, 0}, -1.0 * direction, forces);
  } else {
    add_traction(body, {-0.5, 0.5, 0}, {0.5, 0.5, 0}, direction, forces);
  }
  for (const NodeForce& f : forces) model->add_load(f.node, f.force);
  StepOptions options;
  options.dt = 1e4;  // no inertia is left
  options.gravity = {};
  options.solver = SolverKind::kDirect;
  StepWorkspace workspace;
  EXPECT_TRUE(step(*model, state, options, workspace).ok());
  double work = 0;
  for (const NodeForce& f : forces) work += options.dt * dot(state.velocities[f.node.index()], f.force);
  return work / (norm(direction) * norm(direction)) * kYoung * kThickness;
}

/// Compliance over the reference's for every row: |rows| x 4, 0 where there is none.
std::vector<std::array<double, 4>> ratios(int cells, int layers) {
  std::vector<std::array<double, 4>> all;
  std::printf("%d x %d x %d cells\n  length  middle  tension bending opening tearing\n", cells, cells, layers);
  for (const Row& row : kReference) {
    const Scene scene = plate_scene(cells, layers);
    const Session session = cut_plate(scene, kThickness * row.length, kThickness * row.middle);
    all.push_back({});
    for (const Load load : {kTension, kBending, kOpening, kTearing})
      if (row.compliance[load] > 0)
        all.back()[load] = compliance(session.body(), scene, load, kThickness * row.middle) / row.compliance[load];
    std::printf("  %6.2f %7.2f  %7.3f %7.3f %7.3f %7.3f\n", row.length, row.middle, all.back()[0], all.back()[1],
                all.back()[2], all.back()[3]);
  }
  return all;
}

/// Every ratio within the bounds of its load.
void expect_between(const std::vector<std::array<double, 4>>& all, const std::array<double, 4>& least,
                    const std::array<double, 4>& most) {
  for (std::size_t i = 0; i < all.size(); ++i)
    for (const Load load : {kTension, kBending, kOpening, kTearing}) {
      if (all[i][load] == 0) continue;
      EXPECT_GT(all[i][load], least[load]) << kLoadNames[load] << ", slit of " << kReference[i].length;
      EXPECT_LT(all[i][load], most[load]) << kLoadNames[load] << ", slit of " << kReference[i].length;
    }
}

/// Cells as thick as the plate are stiffer near the tip of a slit than the material is, by no more than this; a tip that lags by
/// a part of a cell leaves half of the compliance. With cells of half the size the error is half as large.
TEST(NotchedPlate, FollowsAFineMeshOfAnotherProgram) {
  const auto coarse = ratios(10, 1), fine = ratios(20, 2);
  expect_between(coarse, {0.82, 0.92, 0.83, 0.74}, {1.0, 1.0, 0.95, 0.93});
  expect_between(fine, {0.92, 0.955, 0.925, 0.86}, {1.0, 1.0, 1.0, 1.0});
  for (std::size_t i = 1; i < coarse.size(); ++i)
    for (const Load load : {kTension, kBending, kOpening, kTearing})
      EXPECT_LT(1 - fine[i][load], 0.7 * (1 - coarse[i][load]))
          << kLoadNames[load] << ", slit of " << kReference[i].length;
}

/// A body that had its slit before there were cells is the body that was cut.
TEST(NotchedPlate, ASlitFromTheStartIsASlitThatWasCut) {
  const Scene scene = plate_scene(10, 1);
  for (const double length : {0.425, 0.45}) {
    const Session session = cut_plate(scene, length, 0.05);
    const auto body = build_body(session.body().complex, scene.lattice, {});
    ASSERT_TRUE(body.ok()) << body.error().message;
    for (const Load load : {kTension, kBending, kOpening, kTearing}) {
      const double cut = compliance(session.body(), scene, load, 0.05);
      EXPECT_NEAR(compliance(*body, scene, load, 0.05), cut, 1e-6 * cut) << kLoadNames[load];
    }
  }
}

}  // namespace
}  // namespace kerf::notched_plate_test
