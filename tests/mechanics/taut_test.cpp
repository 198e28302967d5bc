// Bodies under tension that hardly resist bending: steps longer than their transverse waves take over a cell.
#include <gtest/gtest.h>

#include <cmath>

#include "kerf/base/random.h"
#include "kerf/mechanics/step.h"
#include "mechanics/test_bodies.h"

namespace kerf::taut_test {
namespace {

using test::Grid;

constexpr Grid kGrid{24, 2, 1};
constexpr Vec3 kCell{0.005, 0.005, 0.001};
constexpr double kStretch = 0.05, kLength = kGrid.nx * kCell.x * (1 + kStretch), kHeight = 1e-4;

enum class Matrices { kShared, kOwn };

/// A strip without Poisson's ratio, stretched between held ends, bent to half a sine wave.
MechanicsModel taut_strip(Matrices matrices, MechanicsState& state) {
  Material material;
  material.young = 2e5;
  material.poisson = 0;
  material.damping_mass = 0;
  material.damping_stiffness = 0;
  MechanicsModel model = test::make_box(kGrid, kCell, material);
  if (matrices == Matrices::kOwn)
    for (std::size_t e = 0; e < model.element_count(); ++e) {
      const HexId id(e);
      EXPECT_TRUE(model.set_element(id, model.element(id), model.element_stiffness(id), model.element_masses(id)).ok());
    }
  for (int z = 0; z <= kGrid.nz; ++z)
    for (int y = 0; y <= kGrid.ny; ++y)
      for (const int x : {0, kGrid.nx}) model.fix_node(kGrid.node(x, y, z));
  state = rest_state(model);
  for (Vec3& p : state.positions) {
    p.x *= 1 + kStretch;
    p.z += kHeight * std::sin(M_PI * p.x / kLength);
  }
  return model;
}

StepOptions long_steps() {
  StepOptions options;
  options.dt = 1.0 / 60;
  options.gravity = {};
  options.tolerance = 1e-8;
  return options;
}

TEST(Taut, AStepTakesAStringAsImplicitEulerDoes) {
  // v1 = - dt w^2 z / (1 + dt^2 w^2) with the string's w^2 = stress / density (pi / length)^2. With all of the tension on the right-hand side it
  // would be half as much again.
  for (const Matrices matrices : {Matrices::kShared, Matrices::kOwn}) {
    MechanicsState state;
    MechanicsModel model = taut_strip(matrices, state);
    const Material& material = model.materials()[0];
    StepWorkspace w;
    const StepOptions options = long_steps();
    ASSERT_TRUE(step(model, state, options, w).ok());
    const double square = material.young * kStretch / material.density * std::pow(M_PI / kLength, 2), dt = options.dt;
    const double expected = -dt * square * kHeight / (1 + dt * dt * square);
    EXPECT_GT(dt * dt * square, 1.5);
    EXPECT_NEAR(state.velocities[kGrid.node(kGrid.nx / 2, 1, 0).index()].z, expected, -0.1 * expected);
  }
}

TEST(Taut, AStripUnderTensionComesToRestInLongSteps) {
  // The scatter of one solve is enough: nodes used to go up in one step and down in the next, farther and farther.
  for (const Matrices matrices : {Matrices::kShared, Matrices::kOwn})
    for (const double dt : {0.001, 0.005, 1.0 / 60}) {
      MechanicsState state;
      MechanicsModel model = taut_strip(matrices, state);
      Random random(5);
      for (std::size_t i = 0; i < state.positions.size(); ++i)
        if (!model.is_fixed(NodeId(i))) state.positions[i].z += random.uniform(-0.2, 0.2) * kHeight;
      StepWorkspace w;
      StepOptions options = long_steps();
      options.dt = dt;
      StepReport report;
      for (int i = 0; i < 400; ++i) {
        const Result<StepReport> r = step(model, state, options, w);
        ASSERT_TRUE(r.ok());
        report = *r;
      }
      double square = 0;
      for (const Vec3 v : state.velocities) square += dot(v, v);
      // After 400 steps of 1 ms the ground wave, 12 Hz, still swings at 5 mm/s.
      EXPECT_LT(std::sqrt(square / static_cast<double>(state.velocities.size())), dt < 0.002 ? 1e-2 : 1e-5) << dt;
    }
}

TEST(Taut, IterativeSolversMatchTheDirectOne) {
  for (const Matrices matrices : {Matrices::kShared, Matrices::kOwn}) {
    MechanicsState reference;
    for (const SolverKind solver : {SolverKind::kDirect, SolverKind::kConjugateGradients})
      for (const Preconditioner preconditioner : {Preconditioner::kBlockJacobi, Preconditioner::kTwoLevel}) {
        MechanicsState state;
        MechanicsModel model = taut_strip(matrices, state);
        StepWorkspace w;
        StepOptions options = long_steps();
        options.tolerance = 1e-11;
        options.residual_floor = 0;
        options.solver = solver;
        options.preconditioner = preconditioner;
        for (int i = 0; i < 3; ++i) ASSERT_TRUE(step(model, state, options, w).ok());
        if (reference.positions.empty()) reference = state;
        double most = 0;
        for (std::size_t i = 0; i < state.velocities.size(); ++i)
          most = std::max(most, norm(state.velocities[i] - reference.velocities[i]));
        EXPECT_LT(most, 1e-9);
      }
  }
}

}  // namespace
}  // namespace kerf::taut_test
