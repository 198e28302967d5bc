#include "kerf/mechanics/speed_cap.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kerf/mechanics/tolerances.h"
#include "mechanics/test_bodies.h"

namespace kerf::speed_cap_test {
namespace {

using test::Grid;

constexpr Grid kGrid{4, 2, 1};
constexpr Vec3 kCell{0.01, 0.01, 0.01};
constexpr double kTime = 1e-3, kStep = 1e-4;

struct Body {
  MechanicsModel model = test::make_box(kGrid, kCell, Material{});
  MechanicsState state = rest_state(model);
  SpeedCapWork work;
  double limit = kMostWay * norm(Vec3{0.04, 0.02, 0.01}) / kTime;

  Body() { model.refresh(); }
  SlowedNodes cap(double reached = 0, std::span<const std::uint8_t> touched = {}) {
    return cap_speeds(model, {kTime, reached}, touched, kStep, state, work);
  }
  [[nodiscard]] Vec3 momentum() const {
    Vec3 sum;
    for (std::size_t i = 0; i < model.node_count(); ++i) sum += model.structure().mass[i] * state.velocities[i];
    return sum;
  }
  [[nodiscard]] Vec3 moment() const {
    Vec3 sum;
    for (std::size_t i = 0; i < model.node_count(); ++i) sum += model.structure().mass[i] * state.positions[i];
    return sum;
  }
  [[nodiscard]] double kinetic() const {
    double sum = 0;
    for (std::size_t i = 0; i < model.node_count(); ++i)
      sum += 0.5 * model.structure().mass[i] * dot(state.velocities[i], state.velocities[i]);
    return sum;
  }
};

TEST(SpeedCap, FreeFlightIsLeftAlone) {
  Body body;
  for (Vec3& v : body.state.velocities) v = {30, -4000, 2};
  body.state.velocities[3].z += 0.9 * body.limit;
  const MechanicsState before = body.state;
  EXPECT_EQ(body.cap().count, 0);
  EXPECT_EQ(body.state, before);
}

TEST(SpeedCap, ANodeThatFliesOffIsSlowedDownAndItsPieceKeepsItsMomentum) {
  Body body;
  for (Vec3& v : body.state.velocities) v = {0, 3, 0};
  body.state.velocities[5] = {7000, 3, 100};
  const MechanicsState before = body.state;
  const Vec3 momentum = body.momentum(), moment = body.moment();
  const double kinetic = body.kinetic();
  const SlowedNodes slowed = body.cap();
  EXPECT_EQ(slowed.count, 1);
  EXPECT_GT(slowed.fastest, 6000);
  const Vec3 mean = (1 / body.model.structure().total_mass) * momentum;
  EXPECT_LT(norm(body.state.velocities[5] - mean), slowed.fastest / 10);
  EXPECT_NEAR(norm(body.momentum() - momentum), 0, 1e-12 * norm(momentum));
  EXPECT_NEAR(norm(body.moment() - moment), 0, 1e-12 * norm(moment));
  EXPECT_LT(body.kinetic(), kinetic);
  for (std::size_t i = 0; i < body.model.node_count(); ++i) {
    const Vec3 moved = body.state.positions[i] - before.positions[i],
               changed = body.state.velocities[i] - before.velocities[i];
    EXPECT_NEAR(norm(moved - kStep * changed), 0, 1e-12);
  }
}

// A contact may have pushed a part of it through what it touches. That momentum is none.
TEST(SpeedCap, APieceThatTouchesSomethingIsMeasuredAgainstRest) {
  Body body;
  for (Vec3& v : body.state.velocities) v = {0, 0, 4000};
  body.state.velocities[5] = {0, 0, 1};
  const std::uint8_t touched = 1;
  EXPECT_EQ(body.cap(0, {&touched, 1}).count, static_cast<int>(body.model.node_count()) - 1);
  for (const Vec3 v : body.state.velocities) EXPECT_LE(v.z, body.limit * (1 + 1e-12));
  EXPECT_EQ(body.state.velocities[5].z, 1);
}

// What a fast tool or a fall has given is no error, and a node that something has stopped is never sped up.
TEST(SpeedCap, WhatSomethingAroundHasIsAllowed) {
  Body body;
  for (Vec3& v : body.state.velocities) v = {0, 0, -5 * body.limit};
  for (int x = 0; x <= kGrid.nx; ++x) body.state.velocities[kGrid.node(x, 0, 0).index()] = {};
  const MechanicsState before = body.state;
  EXPECT_EQ(body.cap(5 * body.limit).count, 0);
  EXPECT_EQ(body.state, before);
}

TEST(SpeedCap, SupportsKeepTheirVelocity) {
  Body body;
  body.model.fix_node(NodeId(0), {9000, 0, 0});
  body.model.refresh();
  body.state.velocities[0] = {9000, 0, 0};
  body.state.velocities[7] = {0, 0, 8000};
  EXPECT_EQ(body.cap().count, 1);
  EXPECT_EQ(body.state.velocities[0], (Vec3{9000, 0, 0}));
  EXPECT_LT(body.state.velocities[7].z, 4000);
  EXPECT_EQ(body.state.velocities[1], Vec3{});  // a support takes up the momentum
  EXPECT_EQ(fastest_node(body.model, body.state), 9000);
}

}  // namespace
}  // namespace kerf::speed_cap_test
