// Boxes of unlike cells in one model: each moves as it does in a model of its own.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "kerf/base/random.h"
#include "kerf/mechanics/node_matrix.h"
#include "kerf/mechanics/step.h"
#include "mechanics/test_bodies.h"

namespace kerf::cells_test {
namespace {

using test::Grid;

struct Box {
  Grid grid;
  ElementCell cell;
  Vec3 origin;
  Material material;
  bool held = true;
  Vec3 spin;  ///< 1/s
};

std::vector<Box> boxes() {
  std::vector<Box> out(3);
  out[0] = {{8, 3, 1}, {{0.02, 0.025, 0.01}, {}}, {}, {}, true, {}};
  out[1] = {{9, 4, 2}, {{0.002, 0.0015, 0.001}, test::rotation_about({1, 2, 0.5}, 0.7)}, {0.3, 0.1, 0}, {}, true, {}};
  out[2] = {{4, 4, 1}, {{0.004, 0.004, 0.003}, test::rotation_about({0, 1, 3}, -1.1)}, {0, 0.4, 0.2}, {}, false,
            {3, 9, -4}};
  out[0].material.young = 4e4;
  out[1].material.young = 2e4;
  out[1].material.density = 1300;
  out[2].material.young = 6e4;
  return out;
}

/// Material in the lower part of a cell.
std::vector<MaterialPoint> lower_part(Vec3 size, double fill) {
  std::vector<MaterialPoint> points;
  for (const MaterialPoint& p : full_cell_points(size))
    points.push_back({{p.xi.x, p.xi.y, -1 + fill * (1 + p.xi.z)}, fill * p.volume});
  return points;
}

struct Bodies {
  MechanicsModel model;
  MechanicsState state;
  std::vector<std::size_t> first_node;
};

/// All of them in one model, every third cell or each partly filled. These are set in turn, so that the bodies meet in the pool of own matrices.
Bodies joined(const std::vector<Box>& boxes, int partly = 3) {
  Bodies out{MechanicsModel(boxes[0].cell.size, boxes[0].cell.axes), {}, {}};
  std::vector<std::size_t> first_cell;
  std::size_t cells = 0, most = 0;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const Box& b = boxes[i];
    const std::int32_t cell = i == 0 ? 0 : out.model.add_cell(b.cell);
    EXPECT_TRUE(out.model.add_material(b.material, cell).ok());
    out.first_node.push_back(out.model.node_count());
    const Vec3 h = b.cell.size;
    for (int z = 0; z <= b.grid.nz; ++z)
      for (int y = 0; y <= b.grid.ny; ++y)
        for (int x = 0; x <= b.grid.nx; ++x) {
          const NodeId n = out.model.add_node(b.origin + b.cell.axes * Vec3{x * h.x, y * h.y, z * h.z},
                                              {x + 20 * static_cast<int>(i), y, z});
          if (b.held && x == 0) out.model.fix_node(n);
        }
    first_cell.push_back(cells);
    const auto own = static_cast<std::size_t>(b.grid.nx * b.grid.ny * b.grid.nz);
    cells += own;
    most = std::max(most, own);
  }
  for (std::size_t k = 0; k < most; ++k)
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      const Grid& g = boxes[i].grid;
      const int c = static_cast<int>(k), x = c % g.nx, y = c / g.nx % g.ny, z = c / g.nx / g.ny;
      if (z >= g.nz) continue;
      MechanicsElement e;
      e.nodes = g.corners(x, y, z);
      for (NodeId& n : e.nodes) n = NodeId(n.index() + out.first_node[i]);
      e.material = static_cast<std::int32_t>(i);
      const HexId id(first_cell[i] + k);
      EXPECT_TRUE((c % partly == 0 ? out.model.set_element(id, e, lower_part(boxes[i].cell.size, 0.4 + 0.01 * (c % 7)))
                                   : out.model.set_element(id, e))
                      .ok());
    }
  EXPECT_TRUE(out.model.validate().ok());
  out.state = rest_state(out.model);
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const std::size_t end = i + 1 < boxes.size() ? out.first_node[i + 1] : out.model.node_count();
    for (std::size_t n = out.first_node[i]; n < end; ++n)
      out.state.velocities[n] = cross(boxes[i].spin, out.state.positions[n] - boxes[i].origin);
  }
  return out;
}

void run(Bodies& bodies, const StepOptions& options) {
  StepWorkspace w;
  for (int i = 0; i < 60; ++i) {
    const Result<StepReport> report = step(bodies.model, bodies.state, options, w);
    ASSERT_TRUE(report.ok()) << report.error().message;
    ASSERT_FALSE(report->cap_hit);
  }
}

struct Case {
  const char* name;
  StepOptions options;
  int partly = 3;        ///< every how many cells are partly filled
  double within = 1e-6;  ///< of the motion
};

class Cells : public testing::TestWithParam<Case> {};

TEST_P(Cells, OfTheirOwnMoveEachBodyAsAlone) {
  const std::vector<Box> all = boxes();
  Bodies together = joined(all);
  run(together, GetParam().options);
  for (std::size_t i = 0; i < all.size(); ++i) {
    Bodies alone = joined({all[i]});
    const std::vector<Vec3> rest = alone.state.positions;
    run(alone, GetParam().options);
    double moved = 0, off = 0, turned = 0;
    for (std::size_t n = 0; n < rest.size(); ++n) {
      moved = std::max(moved, norm(alone.state.positions[n] - rest[n]));
      off = std::max(off, norm(alone.state.positions[n] - together.state.positions[together.first_node[i] + n]));
    }
    for (const Mat3& r : alone.state.rotations) turned = std::max(turned, norm(r.c[0] - all[i].cell.axes.c[0]));
    EXPECT_GT(moved, 0.3 * all[i].cell.size.x) << "body " << i;
    EXPECT_GT(turned, 0.05) << "body " << i;
    EXPECT_LT(off, 1e-6 * moved) << "body " << i;
  }
}

StepOptions options_of(Preconditioner preconditioner, SolverKind solver = SolverKind::kConjugateGradients) {
  StepOptions o;
  o.dt = 0.004;
  o.gravity = {30, -12, -30};
  o.tolerance = 1e-12;
  o.residual_floor = 1e-12;
  o.max_iterations = 5000;
  o.preconditioner = preconditioner;
  o.solver = solver;
  return o;
}

INSTANTIATE_TEST_SUITE_P(, Cells,
                         testing::Values(Case{"jacobi", options_of(Preconditioner::kBlockJacobi)},
                                         Case{"two_levels", options_of(Preconditioner::kTwoLevel)},
                                         Case{"direct", options_of(Preconditioner::kTwoLevel, SolverKind::kDirect)}),
                         [](const testing::TestParamInfo<Case>& i) { return std::string(i.param.name); });

TEST(ElementCells, TheMatrixPutTogetherIsThatOfTheCells) {
  Bodies b = joined(boxes(), 1);
  StepOptions o = options_of(Preconditioner::kTwoLevel);
  o.gravity = {300, -120, -300};
  o.tolerance = 1e-2;
  StepWorkspace w;
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(step(b.model, b.state, o, w).ok());
  ASSERT_TRUE(w.node_matrix);
  const MechanicsModel::Structure& s = b.model.structure();
  std::vector<bool> taut(boxes().size());
  for (std::size_t i = 0; i < s.batches.size(); ++i)
    for (std::size_t lane = 0; lane < 4; ++lane)
      if (w.tension[i].v[lane] > 0) taut[static_cast<std::size_t>(s.batches[i].cell)] = true;
  EXPECT_TRUE(taut[0] && taut[1]);
  Random random(3);
  for (auto& q : w.search) q = {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1), 0};
  const std::vector<Vec3> forces = test::product_by_cells(b.model, w);
  narrow_search(w);
  multiply_node_matrix(b.model, w, 0, b.model.node_count());
  for (std::size_t body = 0; body < b.first_node.size(); ++body) {
    const std::size_t begin = b.first_node[body],
                      end = body + 1 < b.first_node.size() ? b.first_node[body + 1] : b.model.node_count();
    double size = 0;
    for (std::size_t i = begin; i < end; ++i)
      for (int a = 0; a < 3; ++a) size = std::max(size, std::fabs(forces[i][a]));
    for (std::size_t i = begin; i < end; ++i)
      for (int a = 0; a < 3 && s.free[i] != 0; ++a)
        EXPECT_NEAR(w.product[i].v[a] - w.mass_diagonal[i] * w.search[i].v[a], forces[i][a], 1e-6 * size)
            << "node " << i;
  }
}

TEST(ElementCells, AnElementThatChangesBodyTakesItsMatrixAlong) {
  const std::vector<Box> all = boxes();
  Bodies b = joined(all);
  const MechanicsElement was = b.model.element(HexId(0));
  MechanicsElement other = was;
  other.material = 1;
  ASSERT_TRUE(b.model.is_partly_filled(HexId(0)));
  ASSERT_TRUE(b.model.set_element(HexId(0), other, lower_part(all[1].cell.size, 0.5)).ok());
  b.model.refresh();
  for (const MechanicsModel::Batch& batch : b.model.structure().batches)
    for (const std::int32_t e : batch.element) {
      if (e < 0) continue;
      EXPECT_EQ(batch.cell, b.model.cell_of(b.model.element(HexId(e)).material)) << "element " << e;
    }
  ASSERT_TRUE(b.model.set_element(HexId(0), was, lower_part(all[0].cell.size, 0.4)).ok());
  Bodies fresh = joined(all);
  EXPECT_EQ(b.model.element_stiffness(HexId(0)), fresh.model.element_stiffness(HexId(0)));
}

TEST(ElementCells, AMaterialNamesACellThatIsThere) {
  MechanicsModel model({1, 1, 1});
  EXPECT_FALSE(model.add_material({}, 1).ok());
  EXPECT_FALSE(model.add_material({}, -1).ok());
  Mat3 skew;
  skew.c[1] = {0.1, 1, 0};
  model.add_cell({{1, 1, 1}, skew});
  EXPECT_FALSE(model.validate().ok());
}

}  // namespace
}  // namespace kerf::cells_test
