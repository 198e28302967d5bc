// Plates, large bending and torque: what the assembled body does at rest.
#include <gtest/gtest.h>

#include <cmath>

#include "kerf/base/rotation.h"
#include "kerf/mechanics/step.h"
#include "mechanics/test_bodies.h"

namespace kerf::statics_test {
namespace {

using test::Grid;

// Deflection of the middle of a square plate under uniform load, relative to Kirchhoff's.
double plate(ElementFormulation formulation, int cells, bool clamped) {
  Material material;
  material.young = 1e6;
  material.poisson = 0.3;
  const double side = 1, thick = side / 50;
  const Grid g{cells, cells, 1};
  const MechanicsModel model = test::make_box(g, {side / cells, side / cells, thick}, material, formulation);
  std::vector<char> fixed(3 * model.node_count(), 0);
  std::vector<double> force(3 * model.node_count(), 0);
  for (int y = 0; y <= cells; ++y)
    for (int x = 0; x <= cells; ++x) {
      const bool edge = x == 0 || y == 0 || x == cells || y == cells;
      const double share = (x == 0 || x == cells ? 0.5 : 1) * (y == 0 || y == cells ? 0.5 : 1) / cells / cells;
      for (int z = 0; z < 2; ++z) {
        const std::size_t i = 3 * g.node(x, y, z).index();
        force[i + 2] = 0.5 * share;
        if (!edge) continue;
        fixed[i + 2] = 1;
        if (clamped) fixed[i] = fixed[i + 1] = 1;
      }
    }
  // Soft simple support; what is left free is the motion in the plane.
  fixed[3 * g.node(0, 0, 0).index()] = fixed[3 * g.node(0, 0, 0).index() + 1] = 1;
  fixed[3 * g.node(cells, 0, 0).index() + 1] = 1;
  const std::vector<double> u = test::static_displacement(model, fixed, force);
  const double middle =
      0.5 * (u[3 * g.node(cells / 2, cells / 2, 0).index() + 2] + u[3 * g.node(cells / 2, cells / 2, 1).index() + 2]);
  const double rigidity = material.young * std::pow(thick, 3) / (12 * (1 - 0.09));
  return middle / ((clamped ? 0.00126532 : 0.00406235) / rigidity);
}

TEST(Statics, ThinPlatesMatchKirchhoff) {
  struct Row {
    int cells;
    bool clamped;
    double incompatible, plain;
  };
  for (const Row& r : {Row{8, false, .918, .126}, Row{16, false, 1.000, .345}, Row{32, false, 1.009, .612},
                       Row{8, true, .851, .090}, Row{16, true, .993, .266}, Row{32, true, 1.005, .538}}) {
    EXPECT_NEAR(plate(ElementFormulation::kIncompatible, r.cells, r.clamped), r.incompatible, 2e-3) << r.cells;
    EXPECT_NEAR(plate(ElementFormulation::kPlain, r.cells, r.clamped), r.plain, 2e-3) << r.cells;
  }
}

TEST(Statics, PatchOfDifferentlyFilledCellsMovesRigidlyForNothing) {
  Material material;
  material.young = 5;
  material.poisson = 0.3;
  const Vec3 h{1, 0.8, 0.6};
  const Grid g{3, 3, 3};
  MechanicsModel model = test::make_box(g, h, material);
  // Every cell filled at random: the only field that all of them agree on is the one without stress.
  Random random(8);
  for (std::int32_t e = 0; e < 27; ++e) {
    std::array<double, 27> volumes;
    for (double& v : volumes) v = random.index(3) == 0 ? 0.0 : random.uniform(0.1, 1) * h.x * h.y * h.z / 27;
    const MechanicsElement element = model.element(HexId(e));
    ASSERT_TRUE(model.set_element(HexId(e), element, material_points_27(volumes)).ok());
  }
  const Vec3 spin{0.3, -0.2, 0.5}, shift{1, 2, 3};
  std::vector<double> force(3 * model.node_count(), 0);
  for (std::int32_t e = 0; e < 27; ++e) {
    const ElementMatrix k = model.element_stiffness(HexId(e));
    for (int i = 0; i < 24; ++i)
      for (int j = 0; j < 24; ++j) {
        const Vec3 u = shift + cross(spin, model.rest_positions()[model.element(HexId(e)).nodes[j / 3].index()]);
        force[3 * model.element(HexId(e)).nodes[i / 3].index() + i % 3] += k[24 * i + j] * u[j % 3];
      }
  }
  for (double f : force) EXPECT_NEAR(f, 0, 1e-12 * 5);
}

TEST(Statics, TensionOfAPartlyFilledPatchIsExact) {
  // A bar in which all cells are filled from below to 30 %: a linear field is a solution; with held ends
  // inner nodes must find it.
  Material material;
  material.young = 5;
  material.poisson = 0;
  const Vec3 h{1, 1, 1};
  const Grid g{4, 2, 1};
  MechanicsModel model = test::make_box(g, h, material);
  std::vector<MaterialPoint> points;
  for (const MaterialPoint& p : full_cell_points(h))
    points.push_back({{p.xi.x, p.xi.y, -1 + 0.3 * (1 + p.xi.z)}, 0.3 * p.volume});
  for (std::int32_t e = 0; e < 8; ++e) {
    const MechanicsElement element = model.element(HexId(e));
    ASSERT_TRUE(model.set_element(HexId(e), element, points).ok());
  }
  const std::size_t n = 3 * model.node_count();
  std::vector<char> fixed(n, 0);
  std::vector<double> force(n, 0), expected(n, 0);
  for (std::size_t i = 0; i < model.node_count(); ++i) expected[3 * i] = 0.1 * model.rest_positions()[i].x;
  // K times the linear field acts on the ends only.
  for (std::int32_t e = 0; e < 8; ++e) {
    const ElementMatrix k = model.element_stiffness(HexId(e));
    const auto& nodes = model.element(HexId(e)).nodes;
    for (int i = 0; i < 24; ++i)
      for (int j = 0; j < 24; ++j)
        force[3 * nodes[i / 3].index() + i % 3] += k[24 * i + j] * expected[3 * nodes[j / 3].index() + j % 3];
  }
  for (std::size_t i = 0; i < model.node_count(); ++i) {
    const double x = model.rest_positions()[i].x;
    for (int a = 0; a < 3; ++a) {
      if (x > 0.5 && x < 3.5) {
        EXPECT_NEAR(force[3 * i + a], 0, 1e-12);
      }
      if (x < 0.5) fixed[3 * i + a] = 1;
    }
  }
  const std::vector<double> u = test::static_displacement(model, fixed, force);
  for (std::size_t i = 0; i < n; ++i) EXPECT_NEAR(u[i], expected[i], 1e-10);
}

TEST(Statics, InnerForcesMakeNoTorque) {
  const Grid g{8, 4, 1};
  const double h = 0.005;
  MechanicsModel model = test::make_box(g, {h, h, h}, {});
  for (const double twist : {5.0, 15.0, 40.0}) {  // radians a metre; the strip is 0.04 m long
    MechanicsState state = rest_state(model);
    for (Vec3& x : state.positions) {
      const double angle = twist * x.x;
      x = {x.x * 1.1 - 5 * x.z * x.x, std::cos(angle) * x.y - std::sin(angle) * x.z,
           std::sin(angle) * x.y + std::cos(angle) * x.z + 5 * x.x * x.x};
    }
    for (std::int32_t e = 0; e < 32; ++e) {  // converged rotations
      Mat3 f;
      for (int a = 0; a < 3; ++a) {
        f.c[a] = {};
        for (int c = 0; c < 8; ++c)
          f.c[a] += corner_sign(c, a) / (4 * h) * state.positions[model.element(HexId(e)).nodes[c].index()];
      }
      state.rotations[e] = followed_rotation(f, {}, 30);
    }
    const std::vector<Vec3> forces = internal_forces(model, state);
    Vec3 sum, torque;
    double scale = 0;
    for (std::size_t i = 0; i < forces.size(); ++i) {
      sum += forces[i];
      torque += cross(state.positions[i], forces[i]);
      scale += norm(forces[i]);
    }
    EXPECT_GT(scale, 0);
    EXPECT_LT(norm(sum), 1e-13 * scale);
    EXPECT_LT(norm(torque), 1e-3 * h * scale) << twist;
  }
}

TEST(Statics, TipLoadedStripFollowsTheElastica) {
  // Strip of 20 cubes; k = F L^2 / E I.
  struct Row {
    double k, tip;
  };  // Bisshopp and Drucker's exact solution, deflection / length
  for (const Row& row : {Row{1, .3017}, Row{2, .4935}, Row{5, .7138}, Row{10, .8106}}) {
    Material material;
    material.young = 1e5;
    material.poisson = 0;
    material.damping_mass = 6;
    const double h = 0.01, length = 20 * h;
    const Grid g{20, 1, 1};
    MechanicsModel model = test::make_box(g, {h, h, h}, material);
    for (int y = 0; y < 2; ++y)
      for (int z = 0; z < 2; ++z) model.fix_node(g.node(0, y, z));
    const double force = row.k * material.young * std::pow(h, 4) / 12 / (length * length);
    for (int y = 0; y < 2; ++y)
      for (int z = 0; z < 2; ++z) model.add_load(g.node(20, y, z), {0, 0, force / 4});
    MechanicsState state = rest_state(model);
    StepWorkspace w;
    StepOptions options;
    options.dt = 0.05;
    options.gravity = {};
    options.tolerance = 1e-6;
    options.residual_floor = 1e-12;
    StepReport report;
    for (int i = 0; i < 400; ++i) {
      const Result<StepReport> r = step(model, state, options, w);
      ASSERT_TRUE(r.ok());
      report = *r;
    }
    EXPECT_LT(report.kinetic_energy, 1e-12);
    double tip = 0;
    Vec3 support;
    for (int y = 0; y < 2; ++y)
      for (int z = 0; z < 2; ++z) {
        tip += (state.positions[g.node(20, y, z).index()].z - z * h) / 4;
        support += reaction(model, w, options, g.node(0, y, z));
      }
    EXPECT_NEAR(tip / length, row.tip, 0.003);
    EXPECT_NEAR(support.z, -force, 1e-4 * force);
    EXPECT_NEAR(support.x, 0, 1e-4 * force);
  }
}

}  // namespace
}  // namespace kerf::statics_test
