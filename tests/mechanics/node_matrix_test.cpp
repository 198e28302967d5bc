// The matrix put together in single precision, compared with products cell by cell.
#include "kerf/mechanics/node_matrix.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "kerf/base/random.h"
#include "kerf/mechanics/step.h"
#include "mechanics/test_bodies.h"

namespace kerf::node_matrix_test {
namespace {

using test::Grid;
constexpr double kH = 0.005, kStep = 0.004;

/// Half of the cells partly filled, one edge held.
MechanicsModel mixed_body(const std::vector<std::int32_t>& order) {
  const Grid g{5, 3, 1};
  MechanicsModel model = test::make_box(g, {kH, kH, kH}, {});
  for (const std::int32_t e : order) {
    std::array<double, 27> volumes;
    Random random(static_cast<std::uint64_t>(e) + 1);
    for (double& v : volumes) v = random.uniform(0, kH * kH * kH / 27);
    std::array<double, 8> masses;
    masses.fill(1e-6);
    EXPECT_TRUE(model.set_element(HexId(e), model.element(HexId(e)), volumes, masses).ok());
  }
  for (std::size_t i = 0; i < model.node_count(); ++i)
    if (model.rest_positions()[i].x < 1e-9) model.fix_node(NodeId(i));
  return model;
}

const std::vector<std::int32_t> kAscending{0, 1, 2, 3, 5, 6, 8, 9, 10, 11, 13, 14},
    kMixed{14, 3, 9, 0, 13, 1, 6, 11, 2, 10, 5, 8};

/// A body in motion, with the matrix of its last step in the workspace.
void move(MechanicsModel& model, MechanicsState& state, StepWorkspace& w) {
  StepOptions options;
  options.dt = kStep;
  options.preconditioner = Preconditioner::kTwoLevel;
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(step(model, state, options, w).ok());
  ASSERT_TRUE(w.node_matrix);
}

TEST(NodeMatrix, GivesTheProductOfTheCells) {
  MechanicsModel model = mixed_body(kAscending);
  MechanicsState state = rest_state(model);
  StepWorkspace w;
  move(model, state, w);
  Random random(3);
  for (auto& q : w.search) q = {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1), 0};
  const std::vector<Vec3> forces = test::product_by_cells(model, w);
  narrow_search(w);
  multiply_node_matrix(model, w, 0, model.node_count());
  double most = 0, wrong = 0;
  for (std::size_t i = 0; i < model.node_count(); ++i)
    for (int a = 0; a < 3; ++a) {
      most = std::max(most, std::abs(forces[i][a]));
      wrong = std::max(wrong, std::abs(w.product[i].v[a] - w.mass_diagonal[i] * w.search[i].v[a] - forces[i][a]));
    }
  EXPECT_GT(most, 0);
  EXPECT_LT(wrong, 1e-6 * most);
}

// Springs within a cell are in its blocks; one between cells is a row.
TEST(NodeMatrix, HoldsTheSpringsOfACell) {
  MechanicsModel model = mixed_body(kAscending);
  const std::array<double, 8> weights{0.3, -0.2, 0.5, 0.1, 0.4, 0.2, -0.6, 0.3};
  for (const std::int32_t e : {0, 5, 5, 14}) {
    RowSpring spring;
    spring.nodes = model.element(HexId(e)).nodes;
    spring.weights = weights;
    spring.stiffness = 30 + e;
    ASSERT_TRUE(model.add_spring(spring).ok());
  }
  RowSpring across;
  across.nodes[0] = NodeId(0);
  across.nodes[1] = NodeId(model.node_count() - 1);
  across.weights[0] = 1;
  across.weights[1] = -1;
  across.stiffness = 50;
  ASSERT_TRUE(model.add_spring(across).ok());
  MechanicsState state = rest_state(model);
  StepWorkspace w;
  move(model, state, w);
  EXPECT_EQ(model.node_matrix().springs.size(), 4u);
  EXPECT_EQ(model.node_matrix().rows, std::vector<std::int32_t>{4});
  Random random(3);
  for (auto& q : w.search) q = {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1), 0};
  const MechanicsModel::Structure& s = model.structure();
  for (std::size_t k = s.element_slots; k < w.slot.size(); ++k) w.slot[k] = {};  // of springs that are rows
  // Products of the cells without their springs, which are added below.
  const std::vector<double> spring_scale = w.spring_scale;
  std::fill(w.spring_scale.begin(), w.spring_scale.end(), 0.0);
  add_springs_to_cells(model, w, kStep);
  std::vector<Vec3> wanted = test::product_by_cells(model, w);
  w.spring_scale = spring_scale;
  narrow_search(w);
  multiply_node_matrix(model, w, 0, model.node_count());
  double most = 0, wrong = 0, of_springs = 0;
  for (std::size_t i = 0; i < model.node_count(); ++i)
    for (int a = 0; a < 3; ++a) wanted[i][a] += w.mass_diagonal[i] * w.search[i].v[a];
  ASSERT_EQ(s.cell_springs.springs.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    const RowSpring& spring = model.springs()[s.springs[i]];
    for (int a = 0; a < 3; ++a) {
      double at = 0;
      for (std::size_t k = 0; k < 8; ++k) at += spring.weights[k] * w.search[spring.nodes[k].index()].v[a];
      for (std::size_t k = 0; k < 8; ++k) {
        const double force = w.spring_scale[i] * spring.weights[k] * at;
        wanted[spring.nodes[k].index()][a] += force;
        of_springs = std::max(of_springs, std::abs(force));
      }
    }
  }
  for (std::size_t i = 0; i < model.node_count(); ++i)
    for (int a = 0; a < 3; ++a) {
      most = std::max(most, std::abs(wanted[i][a]));
      wrong = std::max(wrong, std::abs(w.product[i].v[a] - wanted[i][a]));
    }
  EXPECT_GT(of_springs, 0.01 * most);
  EXPECT_LT(wrong, 1e-6 * most);
}

TEST(NodeMatrix, TranslationsStrainNothingToTheLastBit) {
  MechanicsModel model = mixed_body(kAscending);
  MechanicsState state = rest_state(model);
  StepWorkspace w;
  move(model, state, w);
  for (auto& q : w.search) q = {0.3, -1.7, 12.1, 0};
  narrow_search(w);
  multiply_node_matrix(model, w, 0, model.node_count());
  for (std::size_t i = 0; i < model.node_count(); ++i)
    for (int a = 0; a < 3; ++a) EXPECT_EQ(w.product[i].v[a], w.mass_diagonal[i] * w.search[i].v[a]);
}

TEST(NodeMatrix, ItsBitsDoNotDependOnWhereMatricesLieInThePool) {
  StepWorkspace w[2];
  for (int i = 0; i < 2; ++i) {
    MechanicsModel model = mixed_body(i == 0 ? kAscending : kMixed);
    MechanicsState state = rest_state(model);
    Random random(5);
    for (Vec3& x : state.positions)
      x += 0.1 * kH * Vec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    StepOptions options;
    options.dt = kStep;
    options.preconditioner = Preconditioner::kTwoLevel;
    ASSERT_TRUE(step(model, state, options, w[i]).ok());
  }
  ASSERT_GT(w[0].node_blocks.size(), 0u);
  ASSERT_EQ(w[0].node_blocks.size(), w[1].node_blocks.size());
  EXPECT_EQ(
      std::memcmp(w[0].node_blocks.data(), w[1].node_blocks.data(), w[0].node_blocks.size() * sizeof(NodeBlockPair)),
      0);
}

TEST(NodeMatrix, IsLeftAloneWhereItHasNotEnoughDigits) {
  for (const double tolerance : {1e-2, 1e-9}) {
    MechanicsModel model = mixed_body(kAscending);
    MechanicsState state = rest_state(model);
    StepWorkspace w;
    StepOptions options;
    options.dt = kStep;
    options.preconditioner = Preconditioner::kTwoLevel;
    options.tolerance = tolerance;
    ASSERT_TRUE(step(model, state, options, w).ok());
    EXPECT_EQ(w.node_matrix, tolerance > 1e-3);
  }
}

}  // namespace
}  // namespace kerf::node_matrix_test
