// Changes of the model: elements and nodes added, changed and removed, springs, supports, loads.
#include "kerf/mechanics/mechanics_model.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kerf/mechanics/step.h"
#include "mechanics/test_bodies.h"

namespace kerf::model_test {
namespace {

using test::Grid;

constexpr double kH = 0.005;
constexpr Vec3 kCell{kH, kH, kH};

void fix_edge(MechanicsModel& model, const Grid& g) {
  for (int z = 0; z <= g.nz; ++z)
    for (int y = 0; y <= g.ny; ++y) model.fix_node(g.node(0, y, z));
}

std::vector<MaterialPoint> lower_part(double fill) {
  std::vector<MaterialPoint> points;
  for (const MaterialPoint& p : full_cell_points(kCell))
    points.push_back({{p.xi.x, p.xi.y, -1 + fill * (1 + p.xi.z)}, fill * p.volume});
  return points;
}

StepReport run(MechanicsModel& model, MechanicsState& state, const StepOptions& options, StepWorkspace& w, int steps) {
  StepReport report;
  for (int i = 0; i < steps; ++i) {
    const Result<StepReport> r = step(model, state, options, w);
    EXPECT_TRUE(r.ok()) << (r.ok() ? "" : r.error().message);
    if (!r) break;
    report = *r;
    EXPECT_FALSE(report.cap_hit);
  }
  return report;
}

// Cuts a sheet along x = nx / 2 from y = 0 to y = length: doubles the nodes there but those of the tip.
void slit(MechanicsModel& model, const Grid& g, int length) {
  const int x = g.nx / 2;
  std::vector<NodeId> twin(model.node_count());
  for (int y = 0; y < length; ++y)
    for (int z = 0; z <= g.nz; ++z) {
      const NodeId node = g.node(x, y, z);
      twin[node.index()] = model.add_node(model.rest_positions()[node.index()], model.grid()[node.index()]);
    }
  for (int y = 0; y < std::min(length, g.ny); ++y)
    for (int z = 0; z < g.nz; ++z) {
      MechanicsElement e = model.element(g.cell(x, y, z));
      for (NodeId& n : e.nodes)
        if (twin[n.index()].valid()) n = twin[n.index()];
      ASSERT_TRUE(model.set_element(g.cell(x, y, z), e).ok());
    }
}

TEST(MechanicsModel, ASlitKeepsMassAndEndsInTwoPieces) {
  const Grid g{8, 6, 1};
  MechanicsModel model = test::make_box(g, kCell, {});
  const double mass = model.total_mass();
  EXPECT_EQ(model.piece_count(), 1);
  EXPECT_NEAR(mass, 1000 * 48 * kH * kH * kH, 1e-15);
  MechanicsModel half = model;
  slit(half, g, 4);
  EXPECT_EQ(half.piece_count(), 1);
  EXPECT_NEAR(half.total_mass(), mass, 1e-17);
  slit(model, g, 7);
  EXPECT_EQ(model.piece_count(), 2);
  EXPECT_NEAR(model.total_mass(), mass, 1e-17);
}

TEST(MechanicsModel, ChangingThingsThereAndBackLeavesTheSameBits) {
  const Grid g{8, 6, 1};
  MechanicsModel model = test::make_box(g, kCell, {});
  fix_edge(model, g);
  for (std::int32_t e = 0; e < 48; e += 3) {
    const MechanicsElement element = model.element(HexId(e));
    ASSERT_TRUE(model.set_element(HexId(e), element, lower_part(0.3 + 0.01 * e)).ok());
  }
  MechanicsModel changed = model;
  const std::size_t nodes = model.node_count(), elements = model.element_count();
  slit(changed, g, 5);
  ASSERT_TRUE(changed.set_element(HexId(elements), changed.element(HexId(0))).ok());
  changed.remove_element(HexId(3));
  changed.remove_element(HexId(9));
  changed.refresh_coarse();
  // Back, in another order, so that the pool of own matrices hands out other places.
  for (std::int32_t e : {9, 3}) {
    ASSERT_TRUE(changed.set_element(HexId(e), model.element(HexId(e)), lower_part(0.3 + 0.01 * e)).ok());
  }
  EXPECT_FALSE(changed.truncate(nodes, elements).ok());  // the slit still uses the new nodes
  for (std::int32_t e = 0; e < 48; ++e) {
    if (e % 3 == 0) {
      ASSERT_TRUE(changed.set_element(HexId(e), model.element(HexId(e)), lower_part(0.3 + 0.01 * e)).ok());
    } else {
      ASSERT_TRUE(changed.set_element(HexId(e), model.element(HexId(e))).ok());
    }
  }
  ASSERT_TRUE(changed.truncate(nodes, elements).ok());
  MechanicsState a = rest_state(model), b = rest_state(changed);
  StepWorkspace wa, wb;
  run(model, a, {}, wa, 20);
  run(changed, b, {}, wb, 20);
  EXPECT_TRUE(a == b);
}

// Poses and an undo set matrices again and again; a step works out the last ones alone.
TEST(MechanicsModel, MatricesThatNoStepAskedForLeaveNoTrace) {
  const Grid g{8, 6, 1};
  const auto volumes_of = [](std::int32_t e, int pose) {
    std::array<double, 27> volumes;
    Random random(static_cast<std::uint64_t>(100 * e + pose));
    for (double& v : volumes) v = random.uniform(0.1, 1) * kH * kH * kH / 27;
    return volumes;
  };
  std::array<double, 8> masses;
  masses.fill(1e-5);
  MechanicsState end[2];
  for (const bool ask : {false, true}) {
    MechanicsModel model = test::make_box(g, kCell, {});
    fix_edge(model, g);
    const auto pose = [&](std::int32_t first, int number) {
      for (std::int32_t e = first; e < 48; e += 3)
        ASSERT_TRUE(model.set_element(HexId(e), model.element(HexId(e)), volumes_of(e, number), masses).ok());
      if (ask) model.refresh();
    };
    pose(0, 1);
    MechanicsState state = rest_state(model);
    StepWorkspace w;
    run(model, state, {}, w, 3);
    pose(1, 2);
    // Back: those of the second pose go, so that the third takes their places, and all are set as they were.
    for (std::int32_t e = 1; e < 48; e += 3) model.remove_element(HexId(e));
    pose(2, 3);
    pose(0, 4);
    for (std::int32_t e = 2; e < 48; e += 3) model.remove_element(HexId(e));
    for (std::int32_t e = 1; e < 48; ++e)
      if (e % 3 != 0) {
        ASSERT_TRUE(model.set_element(HexId(e), model.element(HexId(e))).ok());
      }
    pose(0, 1);
    pose(1, 2);
    run(model, state, {}, w, 10);
    end[ask ? 1 : 0] = state;
  }
  EXPECT_TRUE(end[0] == end[1]);
}

TEST(MechanicsModel, IncrementalEqualsBuiltAnew) {
  const Grid g{8, 6, 1};
  MechanicsModel model = test::make_box(g, kCell, {});
  fix_edge(model, g);
  MechanicsState moved = rest_state(model);
  StepWorkspace w;
  run(model, moved, {}, w, 3);  // derived data exists
  slit(model, g, 5);
  model.remove_element(HexId(47));
  MechanicsModel fresh(kCell);
  ASSERT_TRUE(fresh.add_material({}).ok());
  for (std::size_t i = 0; i < model.node_count(); ++i) {
    fresh.add_node(model.rest_positions()[i], model.grid()[i]);
    if (model.is_fixed(NodeId(i))) fresh.fix_node(NodeId(i));
  }
  for (std::size_t e = 0; e < model.element_count(); ++e)
    if (model.has_element(HexId(e))) {
      ASSERT_TRUE(fresh.set_element(HexId(e), model.element(HexId(e))).ok());
    }
  MechanicsState a = rest_state(model), b = rest_state(fresh);
  b.rotations.resize(a.rotations.size());
  StepWorkspace fresh_workspace;
  run(model, a, {}, w, 10);
  run(fresh, b, {}, fresh_workspace, 10);
  EXPECT_TRUE(a == b);
}

// Where matrices lie in their pool is no matter: those of six cells are in two batches, however many there were, and a step has the same bits.
TEST(MechanicsModel, MatricesOfTheirOwnAreGatheredInFewBatches) {
  const Grid g{6, 4, 1};
  MechanicsModel crowded = test::make_box(g, kCell, {}), sparse = test::make_box(g, kCell, {});
  const auto fill = [](std::int32_t e) { return lower_part(0.3 + 0.02 * e); };
  for (std::int32_t e = 0; e < 24; ++e)
    ASSERT_TRUE(crowded.set_element(HexId(e), crowded.element(HexId(e)), fill(e)).ok());
  crowded.refresh();
  ASSERT_EQ(crowded.structure().batches.size(), 6u);
  for (std::int32_t e = 0; e < 24; ++e) {
    if (e % 4 == 1) ASSERT_TRUE(sparse.set_element(HexId(e), sparse.element(HexId(e)), fill(e)).ok());
    else ASSERT_TRUE(crowded.set_element(HexId(e), crowded.element(HexId(e))).ok());
  }
  std::vector<ElementMatrix> before;
  for (std::int32_t e = 0; e < 24; ++e) before.push_back(crowded.element_stiffness(HexId(e)));
  crowded.refresh();
  sparse.refresh();
  const auto own = [](const MechanicsModel& m) { return m.structure().batches.size() - m.structure().full_batches; };
  EXPECT_EQ(own(crowded), 2u);
  EXPECT_EQ(own(sparse), 2u);
  for (std::int32_t e = 0; e < 24; ++e) {
    EXPECT_EQ(crowded.element_stiffness(HexId(e)), before[static_cast<std::size_t>(e)]);
    EXPECT_EQ(crowded.element_stiffness(HexId(e)), sparse.element_stiffness(HexId(e)));
    EXPECT_EQ(crowded.is_partly_filled(HexId(e)), e % 4 == 1);
  }
  const auto moved = [&](MechanicsModel& m, Preconditioner preconditioner, SolverKind solver) {
    fix_edge(m, g);
    MechanicsState state = rest_state(m);
    StepWorkspace w;
    StepOptions options;
    options.preconditioner = preconditioner;
    options.solver = solver;
    run(m, state, options, w, 5);
    return state;
  };
  for (const Preconditioner p : {Preconditioner::kBlockJacobi, Preconditioner::kTwoLevel})
    for (const SolverKind k : {SolverKind::kConjugateGradients, SolverKind::kDirect})
      EXPECT_TRUE(moved(crowded, p, k) == moved(sparse, p, k));
  // Slots that were left are taken again.
  for (const std::int32_t e : {0, 2, 3})
    ASSERT_TRUE(crowded.set_element(HexId(e), crowded.element(HexId(e)), fill(e)).ok());
  crowded.refresh();
  EXPECT_EQ(own(crowded), 3u);
  EXPECT_EQ(crowded.element_stiffness(HexId(3)), [&] {
    MechanicsModel alone = test::make_box(g, kCell, {});
    EXPECT_TRUE(alone.set_element(HexId(3), alone.element(HexId(3)), fill(3)).ok());
    return alone.element_stiffness(HexId(3));
  }());
}

TEST(MechanicsModel, TheCoarseSpaceDoesNotReachAcrossASlit) {
  const Grid g{21, 21, 1};
  Material material;
  material.young = 4e6;
  MechanicsModel model = test::make_box(g, kCell, material);
  for (int z = 0; z <= 1; ++z)
    for (int x = 0; x <= g.nx; ++x) model.fix_node(g.node(x, g.ny, z));
  slit(model, g, 15);
  model.refresh_coarse();
  for (int y = 0; y < 15; ++y) {
    const std::int32_t left = model.coarse().group[g.node(g.nx / 2, y, 0).index()];
    const std::int32_t right = model.coarse().group[model.element(g.cell(g.nx / 2, y, 0)).nodes[0].index()];
    if (y < 12) {
      EXPECT_NE(left, right) << y;
    }
  }
  MechanicsState state = rest_state(model);
  StepWorkspace w;
  StepOptions options;
  options.gravity = {0, 3, -9.81};
  int most = 0;
  for (int i = 0; i < 30; ++i) {
    const StepReport r = run(model, state, options, w, 1);
    if (i > 5) most = std::max(most, r.iterations);
  }
  EXPECT_LE(most, 60);
}

TEST(MechanicsModel, PartlyFilledElementsStepLikeTheDirectSolver) {
  const Grid g{6, 4, 2};
  MechanicsModel model = test::make_box(g, kCell, {});
  fix_edge(model, g);
  Random random(2);
  for (std::int32_t e = 0; e < 48; ++e) {
    MechanicsElement element = model.element(HexId(e));
    element.young_scale = random.uniform(0.5, 3);
    if (e % 2 == 0) {
      ASSERT_TRUE(model.set_element(HexId(e), element, lower_part(random.uniform(0.05, 0.9))).ok());
    } else {
      ASSERT_TRUE(model.set_element(HexId(e), element).ok());
    }
  }
  for (Preconditioner preconditioner : {Preconditioner::kBlockJacobi, Preconditioner::kTwoLevel}) {
    MechanicsState a = rest_state(model), b = a;
    StepWorkspace w;
    StepOptions cg, direct;
    cg.tolerance = 1e-11;
    cg.residual_floor = 0;
    cg.preconditioner = preconditioner;
    direct.solver = SolverKind::kDirect;
    run(model, a, cg, w, 8);
    run(model, b, direct, w, 8);
    double difference = 0, motion = 0;
    for (std::size_t i = 0; i < a.positions.size(); ++i) {
      difference = std::max(difference, norm(a.positions[i] - b.positions[i]));
      motion = std::max(motion, norm(a.positions[i] - model.rest_positions()[i]));
    }
    EXPECT_GT(motion, 1e-3);
    EXPECT_LT(difference, 1e-9 * motion);
  }
}

TEST(MechanicsModel, AttachmentPullsItsPointToItsTarget) {
  const Grid g{6, 4, 1};
  MechanicsModel model = test::make_box(g, kCell, {});
  fix_edge(model, g);
  const auto weights = shape_functions({0.3, -0.2, 0.1});
  Vec3 start;
  for (int c = 0; c < 8; ++c)
    start += weights[c] * model.rest_positions()[model.element(g.cell(5, 2, 0)).nodes[c].index()];
  const Result<SpringReceipt> grasp = model.add_attachment(g.cell(5, 2, 0), weights, start, 1e12, 0.5);
  ASSERT_TRUE(grasp.ok());
  EXPECT_TRUE(grasp->capped);
  EXPECT_NEAR(grasp->stiffness, 10 * 20e3 * kH, 1e-9);
  MechanicsState state = rest_state(model);
  StepWorkspace w;
  StepOptions options;
  options.gravity = {};
  options.tolerance = 1e-8;
  options.residual_floor = 1e-12;
  for (int i = 0; i < 400; ++i) {
    const double t = std::min(1.0, i / 60.0);
    model.set_spring_target(grasp->id, start + t * Vec3{0, 0, 0.01});
    run(model, state, options, w, 1);
  }
  Vec3 at;
  for (int c = 0; c < 8; ++c) at += weights[c] * state.positions[model.element(g.cell(5, 2, 0)).nodes[c].index()];
  EXPECT_NEAR(at.z - start.z, 0.01, 1e-3);
  // At rest the grasp and the supports balance.
  Vec3 sum = spring_force(model, state, grasp->id);
  EXPECT_GT(sum.z, 1e-4);
  for (int z = 0; z <= 1; ++z)
    for (int y = 0; y <= 4; ++y) sum += reaction(model, w, options, g.node(0, y, z));
  EXPECT_LT(norm(sum), 1e-6);
  model.remove_spring(grasp->id);
  EXPECT_FALSE(model.has_spring(grasp->id));
  run(model, state, options, w, 300);
  for (std::size_t i = 0; i < state.positions.size(); ++i)
    EXPECT_LT(norm(state.positions[i] - model.rest_positions()[i]), 1e-4);
}

TEST(MechanicsModel, GlueHoldsTwoNodesTogether) {
  const Grid g{8, 4, 1};
  MechanicsModel model = test::make_box(g, kCell, {});
  fix_edge(model, g);
  slit(model, g, 5);  // right through
  EXPECT_EQ(model.piece_count(), 2);
  for (int y = 0; y < 5; ++y)
    for (int z = 0; z <= 1; ++z) {
      const NodeId left = g.node(4, y, z);
      const NodeId right =
          y < 4 ? model.element(g.cell(4, y, 0)).nodes[4 * z] : model.element(g.cell(4, 3, 0)).nodes[2 + 4 * z];
      ASSERT_TRUE(model.add_node_pair(left, right, 1e12).ok());
    }
  MechanicsState glued = rest_state(model);
  StepWorkspace w;
  StepOptions options;
  run(model, glued, options, w, 60);
  const double hanging = glued.positions[g.node(8, 2, 0).index()].z;
  EXPECT_GT(hanging, -0.04);
  model.clear_springs();
  MechanicsState loose = rest_state(model);
  run(model, loose, options, w, 60);
  EXPECT_LT(loose.positions[g.node(8, 2, 0).index()].z, -4);  // fell for a second
  EXPECT_GT(loose.positions[g.node(4, 2, 0).index()].z, -0.04);
}

TEST(MechanicsModel, AFreePieceFallsLikeAStoneBesideAHeldOne) {
  const Grid g{8, 4, 1};
  MechanicsModel model = test::make_box(g, kCell, {});
  fix_edge(model, g);
  slit(model, g, 5);
  MechanicsState state = rest_state(model);
  StepWorkspace w;
  StepOptions options;
  options.dt = 1.0 / 64;
  run(model, state, options, w, 32);
  EXPECT_NEAR(state.velocities[g.node(8, 2, 0).index()].z, -9.81 / 2, 1e-3);
}

TEST(MechanicsModel, MovingSupportsDragTheBody) {
  const Grid g{6, 4, 1};
  MechanicsModel model = test::make_box(g, kCell, {});
  for (int z = 0; z <= 1; ++z)
    for (int y = 0; y <= 4; ++y) model.fix_node(g.node(0, y, z), {0.02, 0, 0});
  MechanicsState state = rest_state(model);
  StepWorkspace w;
  StepOptions options;
  options.gravity = {};
  run(model, state, options, w, 60);
  for (std::size_t i = 0; i < state.positions.size(); ++i)
    EXPECT_NEAR(state.positions[i].x - model.rest_positions()[i].x, 0.02, 1e-3);
}

TEST(MechanicsModel, RefusesWhatItCannotUse) {
  const Grid g{2, 1, 1};
  MechanicsModel model = test::make_box(g, kCell, {});
  MechanicsElement e = model.element(HexId(0));
  e.nodes[3] = e.nodes[0];
  const Status same = model.set_element(HexId(0), e);
  ASSERT_FALSE(same.ok());
  EXPECT_NE(same.error().message.find("corners 1 and 4"), std::string::npos) << same.error().message;
  e = model.element(HexId(0));
  e.nodes[2] = NodeId(99);
  EXPECT_FALSE(model.set_element(HexId(0), e).ok());
  e = model.element(HexId(0));
  e.material = 7;
  EXPECT_FALSE(model.set_element(HexId(0), e).ok());
  e.material = 0;
  e.young_scale = -1;
  EXPECT_FALSE(model.set_element(HexId(0), e).ok());
  Material bad;
  bad.young = -5;
  EXPECT_FALSE(model.add_material(bad).ok());
  EXPECT_FALSE(model.set_material(0, bad).ok());
  EXPECT_FALSE(model.add_attachment(HexId(77), {}, {}, 1).ok());
  EXPECT_FALSE(model.add_attachment(HexId(0), shape_functions({}), {}, -1).ok());
  EXPECT_FALSE(model.add_node_pair(NodeId(0), NodeId(0), 1).ok());
  EXPECT_FALSE(MechanicsModel({0, 1, 1}).validate().ok());
  Mat3 skew;
  skew.c[1] = {0.1, 1, 0};
  EXPECT_FALSE(MechanicsModel({1, 1, 1}, skew).validate().ok());
  EXPECT_TRUE(model.validate().ok());
}

}  // namespace
}  // namespace kerf::model_test
