// Bodies that are stretched at rest.
#include <gtest/gtest.h>

#include "kerf/mechanics/mechanics_model.h"
#include "kerf/mechanics/step.h"
#include "test_bodies.h"

namespace kerf::prestretch_test {
namespace {

Material material_of(Vec3 prestretch) {
  Material m;
  m.young = 1e5;
  m.poisson = 0;
  m.prestretch = prestretch;
  return m;
}

StepOptions still() {
  StepOptions o;
  o.dt = 0.01;
  o.gravity = {};
  o.tolerance = 1e-9;
  return o;
}

TEST(Prestretch, PullsAtWhatHoldsIt) {
  const test::Grid grid{6, 2, 1};
  const Vec3 h{0.01, 0.012, 0.008};
  MechanicsModel model = test::make_box(grid, h, material_of({1.05, 1, 1}));
  std::vector<NodeId> end;
  for (int x : {0, 6})
    for (int y = 0; y <= 2; ++y)
      for (int z = 0; z <= 1; ++z) {
        model.fix_node(grid.node(x, y, z));
        if (x == 6) end.push_back(grid.node(x, y, z));
      }
  MechanicsState state = rest_state(model);
  StepWorkspace w;
  const StepOptions o = still();
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(step(model, state, o, w).ok());
  double pull = 0;
  for (const NodeId n : end) pull += reaction(model, w, o, n).x;
  const double area = 2 * h.y * h.z, strain = 1 - 1 / 1.05;
  EXPECT_NEAR(pull / (1e5 * strain * area), 1, 1e-6);
}

TEST(Prestretch, WhatNothingHoldsTakesItsNaturalLengths) {
  const test::Grid grid{4, 3, 2};
  Material m = material_of({1.1, 1.04, 1});
  m.damping_mass = 5;
  MechanicsModel model = test::make_box(grid, {0.01, 0.01, 0.01}, m);
  MechanicsState state = rest_state(model);
  StepWorkspace w;
  for (int i = 0; i < 200; ++i) ASSERT_TRUE(step(model, state, still(), w).ok());
  Box3 box;
  for (const Vec3 p : state.positions) box.add(p);
  EXPECT_NEAR(box.size().x * 1.1 / 0.04, 1, 1e-6);
  EXPECT_NEAR(box.size().y * 1.04 / 0.03, 1, 1e-6);
  EXPECT_NEAR(box.size().z / 0.02, 1, 1e-6);
}

TEST(Prestretch, ANumberOutOfRangeIsRefused) {
  EXPECT_FALSE(validate(material_of({0.4, 1, 1})).ok());
  EXPECT_FALSE(validate(material_of({1, 2.1, 1})).ok());
  EXPECT_TRUE(validate(material_of({1, 1, 0.9})).ok());
}

}  // namespace
}  // namespace kerf::prestretch_test
