// A step in steady state allocates nothing.
#include <gtest/gtest.h>

#include "kerf/mechanics/step.h"
#include "mechanics/contact_bodies.h"
#include "support/counted_new.h"

namespace kerf::allocation_test {
namespace {

TEST(Allocation, AStepInSteadyStateAllocatesNothing) {
  const test::Grid g{9, 9, 1};
  for (bool held : {true, false}) {
    MechanicsModel model = test::make_box(g, {0.005, 0.005, 0.005}, {});
    if (held)
      for (int y = 0; y <= 9; ++y) model.fix_node(g.node(0, y, 0), {0, 0, 0.001});
    const auto grasp = model.add_attachment(g.cell(5, 5, 0), shape_functions({}), {0.03, 0.03, 0.01}, 10);
    ASSERT_TRUE(grasp.ok());
    if (!held) model.remove_spring(grasp->id);
    MechanicsState state = rest_state(model);
    for (std::size_t i = 0; i < state.positions.size(); ++i)
      state.positions[i].z += 3 * state.positions[i].x * state.positions[i].x;
    StepWorkspace w;
    StepOptions options;
    long before = 0;
    bool two_level = false;
    for (int i = 0; i < 60; ++i) {
      if (i == 10) before = allocations.load();
      if (held) model.set_spring_target(grasp->id, {0.03, 0.03, 0.01 + 0.0001 * i});
      const Result<StepReport> report = step(model, state, options, w);
      ASSERT_TRUE(report.ok());
      two_level = two_level || report->two_level;
    }
    EXPECT_TRUE(two_level);
    EXPECT_EQ(allocations.load() - before, 0);
  }
  // The same with contacts that press and slide, and a tool.
  for (Preconditioner preconditioner : {Preconditioner::kAdaptive, Preconditioner::kTwoLevel}) {
    MechanicsModel model = test::make_box(g, {0.005, 0.005, 0.005}, {});
    MechanicsState state = rest_state(model);
    state.tools.emplace_back();
    StepWorkspace w;
    StepOptions options;
    options.preconditioner = preconditioner;
    ContactSet set;
    test::Plane plane;
    plane.friction = 0.3;
    plane.velocity = {0.3, 0, 0};
    RigidTool tool;
    tool.stiffness = 100;
    long before = 0;
    int pressing = 0;
    for (int i = 0; i < 80; ++i) {
      test::clear(set);
      test::bottom_rows(model, state, g, plane, set);
      std::uint64_t key = 1000;
      for (double x : {-0.5, 0.0, 0.5})
        for (double y : {-0.5, 0.5}) test::add_plane_row(model, state, g.cell(4, 4, 0), {x, y, -1}, plane, key++, set);
      test::add_plane_row(model, state, g.cell(2, 2, 0), {0, 0, 1}, {{0, 0, 0.0051}, {0, 0, -1}, {}, 0.1}, key++, set);
      set.rows.back().rigid = 0;
      set.tools.assign(1, tool);
      if (i == 30) before = allocations.load();
      const Result<StepReport> report = step(model, state, options, w, &set);
      ASSERT_TRUE(report.ok());
      pressing = report->pressing;
    }
    EXPECT_GT(pressing, 50);
    EXPECT_FALSE(w.contact.cells.empty());
    EXPECT_EQ(allocations.load() - before, 0);
  }
  const long before = allocations.load();  // and the counter counts
  std::vector<int> something(100);
  EXPECT_GT(allocations.load() + static_cast<long>(something[5]), before);
}

}  // namespace
}  // namespace kerf::allocation_test
