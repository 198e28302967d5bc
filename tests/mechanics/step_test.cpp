#include "kerf/mechanics/step.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kerf/base/parallel.h"
#include "mechanics/test_bodies.h"

namespace kerf::step_test {
namespace {

using test::Grid;

Material soft() { return {}; }
Material stiff() {
  Material m;
  m.young = 4e6;
  return m;
}

constexpr Vec3 kCell{0.005, 0.005, 0.005};

void fix_edge(MechanicsModel& model, const Grid& g) {
  for (int z = 0; z <= g.nz; ++z)
    for (int y = 0; y <= g.ny; ++y) model.fix_node(g.node(0, y, z));
}

StepReport run(MechanicsModel& model, MechanicsState& state, const StepOptions& options, StepWorkspace& w, int steps) {
  StepReport report;
  for (int i = 0; i < steps; ++i) {
    Result<StepReport> r = step(model, state, options, w);
    EXPECT_TRUE(r.ok()) << (r.ok() ? "" : r.error().message);
    if (!r) break;
    report = *r;
    EXPECT_FALSE(report.cap_hit);
  }
  return report;
}

double largest_difference(const MechanicsState& a, const MechanicsState& b) {
  double d = 0;
  for (std::size_t i = 0; i < a.positions.size(); ++i) d = std::max(d, norm(a.positions[i] - b.positions[i]));
  return d;
}

TEST(Step, FreeFallIsExact) {
  const Grid g{4, 3, 1};
  MechanicsModel model = test::make_box(g, kCell, stiff());
  MechanicsState state = rest_state(model);
  StepWorkspace w;
  StepOptions options;
  options.dt = 0.01;
  const StepReport report = run(model, state, options, w, 50);
  EXPECT_EQ(report.iterations, 0);
  for (std::size_t i = 0; i < model.node_count(); ++i) {
    EXPECT_NEAR(state.velocities[i].z, -9.81 * 0.5, 1e-9);
    // Implicit Euler: sum of k g dt^2.
    EXPECT_NEAR(state.positions[i].z - model.rest_positions()[i].z, -9.81 * 1e-4 * 50 * 51 / 2, 1e-9);
  }
}

TEST(Step, RigidMotionMakesNoForce) {
  const Grid g{4, 3, 2};
  MechanicsModel model = test::make_box(g, kCell, soft());
  MechanicsState state = rest_state(model);
  const Mat3 turn = test::rotation_about({1, 2, -0.5}, M_PI / 2);
  for (std::size_t i = 0; i < model.node_count(); ++i)
    state.positions[i] = turn * model.rest_positions()[i] + Vec3{0.3, -0.2, 0.1};
  for (Mat3& r : state.rotations) r = test::rotation_about({1, 2, -0.5}, M_PI / 2 - 0.05);
  double largest = 0;
  for (Vec3 f : internal_forces(model, state)) largest = std::max(largest, norm(f));
  // Positions carry rounding of 1e-16 m, two iterations an error of 1e-12 rad.
  EXPECT_LT(largest, 1e-11 * soft().young * kCell.x * kCell.x);
  for (Mat3& r : state.rotations) r = turn;
  largest = 0;
  for (Vec3 f : internal_forces(model, state)) largest = std::max(largest, norm(f));
  EXPECT_LT(largest, 1e-12 * soft().young * kCell.x * kCell.x);
}

TEST(Step, IterativeSolversMatchTheDirectOne) {
  const Grid g{9, 9, 1};
  for (const Material& material : {soft(), stiff()}) {
    MechanicsModel model = test::make_box(g, kCell, material);
    fix_edge(model, g);
    ASSERT_TRUE(model.add_attachment(g.cell(5, 5, 0), shape_functions({0.2, -0.3, 0.5}), {0.03, 0.03, 0.01}, 1e9).ok());
    for (Preconditioner preconditioner :
         {Preconditioner::kBlockJacobi, Preconditioner::kTwoLevel, Preconditioner::kAdaptive}) {
      MechanicsState state = rest_state(model), other = state;
      StepWorkspace w;
      StepOptions cg, direct;
      cg.tolerance = 1e-11;
      cg.residual_floor = 0;
      cg.max_iterations = 5000;
      cg.preconditioner = preconditioner;
      direct.solver = SolverKind::kDirect;
      StepReport report;
      for (int i = 0; i < 5; ++i) {
        report = run(model, state, cg, w, 1);
        run(model, other, direct, w, 1);
      }
      EXPECT_LT(largest_difference(state, other), 1e-9 * 0.05);
      EXPECT_GT(largest_difference(state, rest_state(model)), 1e-4);
      EXPECT_EQ(report.two_level, preconditioner != Preconditioner::kBlockJacobi);
    }
  }
}

TEST(Step, SnapshotRestoreStepEqualsStep) {
  const Grid g{9, 9, 1};
  MechanicsModel model = test::make_box(g, kCell, soft());
  fix_edge(model, g);
  MechanicsState state = rest_state(model);
  StepWorkspace w;
  StepOptions options;
  run(model, state, options, w, 20);
  const MechanicsState snapshot = state;
  run(model, state, options, w, 10);
  const MechanicsState after = state;
  run(model, state, options, w, 7);
  state = snapshot;
  StepWorkspace fresh;
  run(model, state, options, fresh, 10);
  EXPECT_TRUE(state == after);
}

TEST(Step, SameBitsForAnyNumberOfThreads) {
  const Grid g{40, 40, 1};
  MechanicsModel model = test::make_box(g, kCell, soft());
  fix_edge(model, g);
  StepOptions options;
  MechanicsState serial = rest_state(model), two = serial;
  StepWorkspace w1, w2;
  run(model, serial, options, w1, 4);
  options.parallel = true;
  {
    const ThreadLimit limit(2);
    run(model, two, options, w2, 4);
  }
  EXPECT_TRUE(serial == two);
}

}  // namespace
}  // namespace kerf::step_test
