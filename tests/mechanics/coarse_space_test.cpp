#include "kerf/mechanics/coarse_space.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "kerf/base/random.h"
#include "kerf/mechanics/block_cholesky.h"
#include "kerf/mechanics/step.h"
#include "mechanics/test_bodies.h"

namespace kerf::coarse_space_test {
namespace {

using test::Grid;

TEST(BlockCholesky, SolvesLikeEigen) {
  Random random(1);
  for (int round = 0; round < 30; ++round) {
    const int rows = 1 + random.index(25);
    std::vector<std::pair<std::int32_t, std::int32_t>> pairs;
    for (int i = 0; i < rows; ++i)
      for (int j = i + 1; j < rows; ++j)
        if (random.index(5) == 0) pairs.emplace_back(i, j);
    const BlockCholeskyStructure s = block_cholesky_structure(rows, pairs);
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(6 * rows, 6 * rows);
    std::vector<double> blocks(kBlockDoubles * s.block_count(), 0.0);
    const auto put = [&](int i, int j) {  // position i >= position j
      for (int a = 0; a < 6; ++a)
        for (int b = 0; b < 6; ++b) {
          const double x = random.uniform(-1, 1);
          dense(6 * i + a, 6 * j + b) += x;
          dense(6 * j + b, 6 * i + a) += x;
        }
    };
    for (const auto& [i, j] : pairs) s.position[i] > s.position[j] ? put(i, j) : put(j, i);
    for (int i = 0; i < rows; ++i) put(i, i);
    dense += 40 * rows * Eigen::MatrixXd::Identity(6 * rows, 6 * rows);
    const auto copy = [&](int i, int j) {
      double* block = blocks.data() + kBlockDoubles * s.block(i, j);
      for (int a = 0; a < 6; ++a)
        for (int b = 0; b < 6; ++b) block[8 * b + a] = dense(6 * i + a, 6 * j + b);
    };
    for (const auto& [i, j] : pairs) s.position[i] > s.position[j] ? copy(i, j) : copy(j, i);
    for (int i = 0; i < rows; ++i) copy(i, i);
    Eigen::VectorXd b(6 * rows);
    std::vector<double> x(kBlockRow * rows, 0.0);
    for (int i = 0; i < 6 * rows; ++i) b[i] = x[kBlockRow * s.position[i / 6] + i % 6] = random.uniform(-1, 1);
    block_cholesky_factor(s, blocks);
    block_cholesky_solve(s, blocks, x);
    const Eigen::VectorXd expected = dense.ldlt().solve(b);
    for (int i = 0; i < 6 * rows; ++i)
      ASSERT_NEAR(x[kBlockRow * s.position[i / 6] + i % 6], expected[i], 1e-12 * expected.cwiseAbs().maxCoeff());
  }
}

TEST(BlockCholesky, LeavesOutWhatHasNoPivot) {
  double block[kBlockDoubles] = {};
  for (int i = 0; i < 5; ++i) block[8 * i + i] = 2;  // the sixth freedom does nothing
  factor_block(block);
  double x[8] = {2, 4, 6, 8, 10, 12, 0, 0};
  solve_block(block, x);
  for (int i = 0; i < 5; ++i) EXPECT_DOUBLE_EQ(x[i], i + 1);
  EXPECT_EQ(x[5], 0);
}

/// At rest the coarse solve of A P y must return y: P' A P is exact there. A times a vector comes from the direct assembly below, P from the definition.
void expect_galerkin_product(MechanicsModel& model, std::int32_t elements, std::int32_t springs, bool by_nodes,
                             double tolerance) {
  MechanicsState state = rest_state(model);
  StepWorkspace w;
  StepOptions options;
  options.preconditioner = Preconditioner::kTwoLevel;
  ASSERT_TRUE(step(model, state, options, w).ok());  // arms and factor belong to the rest positions
  EXPECT_EQ(w.node_matrix, by_nodes);
  // w.position has moved on; the arms have not.
  const CoarseStructure& c = model.coarse();
  ASSERT_GT(c.groups, 3);
  Random random(7);
  std::vector<double> y(8 * c.groups, 0.0);
  for (std::int32_t p = 0; p < c.groups; ++p)
    for (int i = 0; i < 6; ++i) y[8 * p + i] = random.uniform(-1, 1);
  std::vector<Vec3> v(model.node_count()), av(model.node_count());
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (c.place[i] < 0) continue;
    const double* q = &y[8 * c.place[i]];
    v[i] = Vec3{q[0], q[1], q[2]} + cross({q[3], q[4], q[5]}, {w.arm[i].v[0], w.arm[i].v[1], w.arm[i].v[2]});
  }
  const double dt = options.dt;
  for (std::size_t i = 0; i < v.size(); ++i) av[i] = model.node_mass(NodeId(i)) * v[i];
  for (std::int32_t e = 0; e < elements; ++e) {
    const ElementMatrix k = model.element_stiffness(HexId(e));
    const auto& nodes = model.element(HexId(e)).nodes;
    for (int i = 0; i < 24; ++i)
      for (int j = 0; j < 24; ++j)
        av[nodes[i / 3].index()][i % 3] += dt * dt * k[24 * i + j] * v[nodes[j / 3].index()][j % 3];
  }
  for (std::int32_t s = 0; s < springs; ++s) {
    const RowSpring& spring = model.spring(SpringId(s));
    Vec3 at;
    for (int k = 0; k < 8; ++k)
      if (spring.nodes[k].valid()) at += spring.weights[k] * v[spring.nodes[k].index()];
    for (int k = 0; k < 8; ++k)
      if (spring.nodes[k].valid()) av[spring.nodes[k].index()] += dt * dt * spring.stiffness * spring.weights[k] * at;
  }
  for (std::size_t i = 0; i < v.size(); ++i) w.residual[i] = {{av[i].x, av[i].y, av[i].z, 0}};
  solve_coarse(model, w, false);
  for (std::size_t i = 0; i < y.size(); ++i) EXPECT_NEAR(w.coarse.value[i], y[i], tolerance) << i;
}

/// The lower half of every cell.
std::vector<MaterialPoint> half_cell(double h) {
  std::vector<MaterialPoint> points;
  for (const MaterialPoint& p : full_cell_points({h, h, h}))
    points.push_back({{p.xi.x, p.xi.y, 0.5 * (p.xi.z - 1)}, 0.5 * p.volume});
  return points;
}

/// every: each so many cells are partly filled; where most are, the coarse matrix comes from the node matrix, which is in single precision.
void expect_galerkin_product_of_a_plate(std::int32_t every, double tolerance) {
  const Grid g{9, 7, 1};
  const double h = 0.005;
  MechanicsModel model = test::make_box(g, {h, h, h}, Material());
  for (int y = 0; y <= 7; ++y) model.fix_node(g.node(0, y, 0));  // only one layer: cells with some held corners
  for (std::int32_t e = 0; e < 63; e += every) {
    const MechanicsElement element = model.element(HexId(e));
    ASSERT_TRUE(model.set_element(HexId(e), element, half_cell(h)).ok());
  }
  ASSERT_TRUE(model.add_attachment(g.cell(2, 2, 0), shape_functions({0.3, 0.8, 0}), {}, 50).ok());
  ASSERT_TRUE(model.add_node_pair(g.node(1, 1, 0), g.node(8, 6, 1), 20).ok());
  expect_galerkin_product(model, 63, 2, every == 1, tolerance);
}

TEST(CoarseSpace, IsTheGalerkinProductOfTheStepsMatrix) { expect_galerkin_product_of_a_plate(4, 1e-8); }

TEST(CoarseSpace, IsTheSameFromTheNodeMatrix) { expect_galerkin_product_of_a_plate(1, 1e-4); }

TEST(CoarseSpace, ManyGroupsMayMeetAtANode) {
  // A bar that cuts along it have split into strips, all on the same cells: where they hang together, every node has as many groups beside it as there
  // are strips. From 16 on they are not all kept at once.
  for (const int strips : {3, 14, 15, 16, 17, 40}) {
    const double h = 0.005;
    constexpr int kLong = 6, kWhole = 3;
    MechanicsModel model({h, h, h}, {}, ElementFormulation::kIncompatible);
    ASSERT_TRUE(model.add_material(Material()).ok());
    const auto add_section = [&](int x) {
      std::array<NodeId, 4> section;
      for (int k = 0; k < 4; ++k)
        section[static_cast<std::size_t>(k)] = model.add_node({x * h, (k & 1) * h, (k >> 1) * h}, {x, k & 1, k >> 1});
      return section;
    };
    std::int32_t elements = 0;
    const auto join = [&](const std::array<NodeId, 4>& a, const std::array<NodeId, 4>& b) {
      MechanicsElement element;
      for (std::size_t k = 0; k < 8; ++k) element.nodes[k] = k % 2 == 0 ? a[k / 2] : b[k / 2];
      ASSERT_TRUE(model.set_element(HexId(elements++), element, half_cell(h)).ok());
    };
    std::array<NodeId, 4> last = add_section(0);
    for (int x = 1; x < kWhole; ++x) {
      const auto next = add_section(x);
      join(last, next);
      last = next;
    }
    for (int strip = 0; strip < strips; ++strip) {
      std::array<NodeId, 4> end = last;
      for (int x = kWhole; x < kLong; ++x) {
        const auto next = add_section(x);
        join(end, next);
        end = next;
      }
    }
    model.refresh();
    expect_galerkin_product(model, elements, 0, true, 2e-3);
    EXPECT_GE(model.coarse().groups, strips + 1);
  }
}

}  // namespace
}  // namespace kerf::coarse_space_test
