// The loops over batches: products of many cells in several chunks, and cells with nodes without mass.
#include "kerf/mechanics/element_pass.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "kerf/base/random.h"
#include "kerf/mechanics/step.h"
#include "mechanics/test_bodies.h"

namespace kerf::element_pass_test {
namespace {

using test::Grid;
constexpr double kH = 0.005;

/// Every seventh cell is partly filled. Two springs tie nodes of both kinds, four those of partly filled cells.
MechanicsModel large_body() {
  const Grid g{40, 30, 1};
  Material material;
  material.damping_stiffness = 0.002;
  MechanicsModel model = test::make_box(g, {kH, kH, kH}, material);
  Random random(7);
  for (std::int32_t e = 0; e < 1200; e += 7) {
    std::array<double, 27> volumes;
    for (double& v : volumes) v = random.uniform(0, kH * kH * kH / 27);
    std::array<double, 8> masses;
    masses.fill(1e-6);
    MechanicsElement element = model.element(HexId(e));
    element.young_scale = random.uniform(0.5, 2);
    EXPECT_TRUE(model.set_element(HexId(e), element, volumes, masses).ok());
  }
  EXPECT_TRUE(model.add_node_pair(g.node(0, 0, 0), g.node(20, 15, 1), 5).ok());
  EXPECT_TRUE(model.add_attachment(g.cell(39, 29, 0), shape_functions({0.2, -0.4, 0.6}), {}, 3).ok());
  EXPECT_TRUE(model.add_attachment(g.cell(7, 0, 0), shape_functions({0.2, -0.4, 0.6}), {}, 20).ok());
  EXPECT_TRUE(model.add_attachment(g.cell(35, 0, 0), shape_functions({-0.7, 0.1, 0}), {}, 30).ok());
  EXPECT_TRUE(model.add_attachment(g.cell(35, 0, 0), shape_functions({1, 1, -0.2}), {}, 40).ok());
  EXPECT_TRUE(model.add_node_pair(g.node(15, 1, 1), g.node(14, 0, 0), 50).ok());
  return model;
}

/// What of the whole matrix belongs to elements and springs, by their stiffness at rest, turned.
std::vector<Vec3> product_by_matrices(const MechanicsModel& model, const StepWorkspace& w, double dt) {
  const MechanicsModel::Structure& s = model.structure();
  std::vector<Vec3> out(model.node_count());
  for (std::size_t batch = 0; batch < s.batches.size(); ++batch)
    for (int lane = 0; lane < MechanicsModel::kLanes; ++lane) {
      const std::int32_t e = s.batches[batch].element[static_cast<std::size_t>(lane)];
      if (e < 0) continue;
      const MechanicsElement& element = model.element(HexId(e));
      const ElementMatrix k = model.element_stiffness(HexId(e));
      Mat3 r;
      for (std::size_t i = 0; i < 9; ++i) r.c[i % 3][static_cast<int>(i / 3)] = w.rotation[9 * batch + i].v[lane];
      double u[24] = {};
      for (std::size_t c = 0; c < 8; ++c) {
        const double* p = w.search[element.nodes[c].index()].v;
        for (std::size_t a = 0; a < 3; ++a) u[3 * c + a] = dot(r.c[a], Vec3{p[0], p[1], p[2]});
      }
      const double scale = dt * dt + dt * model.materials()[0].damping_stiffness;
      for (std::size_t c = 0; c < 8; ++c) {
        Vec3 force;
        for (std::size_t a = 0; a < 3; ++a)
          for (std::size_t j = 0; j < 24; ++j) force[static_cast<int>(a)] += k[24 * (3 * c + a) + j] * u[j];
        out[element.nodes[c].index()] += scale * (r * force);
      }
    }
  for (const std::int32_t number : s.springs) {
    const RowSpring& spring = model.springs()[static_cast<std::size_t>(number)];
    Vec3 at;
    for (std::size_t i = 0; i < 8; ++i)
      if (spring.nodes[i].valid()) {
        const double* p = w.search[spring.nodes[i].index()].v;
        at += spring.weights[i] * Vec3{p[0], p[1], p[2]};
      }
    for (std::size_t i = 0; i < 8; ++i)
      if (spring.nodes[i].valid()) out[spring.nodes[i].index()] += dt * dt * spring.stiffness * spring.weights[i] * at;
  }
  return out;
}

/// The springs' part of a product, into their slots.
void multiply_springs(const MechanicsModel& model, StepWorkspace& w) {
  const MechanicsModel::Structure& s = model.structure();
  for (std::size_t i = 0; i < s.springs.size(); ++i) {
    const RowSpring& spring = model.springs()[static_cast<std::size_t>(s.springs[i])];
    Lanes at = all_lanes(0);
    for (std::size_t k = 0; k < 8; ++k)
      if (spring.nodes[k].valid()) at += spring.weights[k] * load_lanes(w.search[spring.nodes[k].index()].v);
    for (std::size_t k = 0; k < 8; ++k)
      store_lanes(w.slot[s.element_slots + 8 * i + k].v, w.spring_scale[i] * spring.weights[k] * at);
  }
}

TEST(ElementPass, ProductsInSeveralChunksAreThoseOfTheMatrices) {
  MechanicsModel model = large_body();
  MechanicsState state = rest_state(model);
  Random random(3);
  for (Vec3& x : state.positions)
    x += 0.02 * kH * Vec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
  StepOptions options;
  options.dt = 0.002;
  options.gravity = {};
  StepWorkspace w;
  ASSERT_TRUE(step(model, state, options, w).ok());
  const MechanicsModel::Structure& s = model.structure();
  ASSERT_GT(s.full_batches, 2 * s.sum_grain);
  EXPECT_EQ(s.cell_springs.springs.size(), 4u);
  EXPECT_EQ(s.cell_springs.rows.size(), 2u);
  // Nodes with several sums, and with sums and slots.
  std::size_t several = 0, mixed = 0;
  for (std::size_t i = 0; i < model.node_count(); ++i) {
    if (s.summed[i] == 0) continue;
    for (std::int32_t k = s.more_begin[i]; k < s.more_begin[i + 1]; ++k)
      ++(static_cast<std::size_t>(s.more[static_cast<std::size_t>(k)]) < s.sums ? several : mixed);
  }
  EXPECT_GT(several, 50u);
  EXPECT_GT(mixed, 500u);
  for (auto& q : w.search) q = {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1), 0};
  for (auto& tension : w.tension) tension = {};  // the matrices have none
  multiply_springs(model, w);
  const std::vector<Vec3> expected = product_by_matrices(model, w, options.dt),
                          forces = test::product_by_cells(model, w);
  double most = 0, wrong = 0;
  for (std::size_t i = 0; i < model.node_count(); ++i) {
    most = std::max(most, norm(expected[i]));
    wrong = std::max(wrong, norm(forces[i] - expected[i]));
  }
  EXPECT_GT(most, 0);
  EXPECT_LT(wrong, 1e-12 * most);
}

// Of a cell with little material some nodes may have no mass, and so belong to no piece.
TEST(ElementPass, ACellWithAMasslessNodeBelongsToThePieceOfTheOthers) {
  const Grid g{2, 1, 1};
  const NodeId massless = g.node(1, 0, 0);
  for (const bool held : {false, true}) {
    MechanicsModel model = test::make_box(g, {kH, kH, kH}, {});
    for (std::size_t e = 0; e < 2; ++e) {
      std::array<double, 8> masses;
      masses.fill(1e-6);
      masses[1 - e] = 0;
      ASSERT_EQ(model.element(HexId(e)).nodes[1 - e], massless);
      ASSERT_TRUE(model.set_element(HexId(e), model.element(HexId(e)), masses).ok());
    }
    if (held) model.fix_node(g.node(0, 1, 0));
    model.refresh();
    const RigidPieces& rigid = model.structure().rigid;
    EXPECT_EQ(rigid.piece[massless.index()], -1);
    EXPECT_EQ(rigid.pieces, 1);
    EXPECT_EQ(rigid.is_free(model.element(HexId(1)).nodes), !held);
    EXPECT_FALSE(rigid.is_free(std::array{massless, NodeId()}));

    // Without weight a free piece under tension has none in its matrix, a held one has.
    MechanicsState state = rest_state(model);
    for (Vec3& x : state.positions) x = 2 * x;
    StepOptions options;
    options.gravity = {};
    StepWorkspace w;
    ASSERT_TRUE(step(model, state, options, w).ok());
    for (std::size_t lane = 0; lane < 2; ++lane) EXPECT_EQ(w.tension[0].v[lane] > 0, held);
  }
}

}  // namespace
}  // namespace kerf::element_pass_test
