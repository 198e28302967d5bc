// The haptic channel without a session: the proxy's static problem, the reduction of contacts, the hand-over between threads.
#include <gtest/gtest.h>

#include <cmath>
#include <thread>

#include "kerf/base/latest.h"
#include "kerf/base/random.h"
#include "kerf/session/haptic_model.h"

namespace kerf::haptic_model_test {
namespace {

HapticModel coupling(double stiffness) {
  HapticModel model;
  model.stiffness = stiffness;
  model.turning_stiffness = stiffness * 4e-4;
  return model;
}

HapticModel with_plane(double stiffness, Vec3 arm, Vec3 normal, double depth, double tissue) {
  HapticModel model = coupling(stiffness);
  model.plane_count = 1;
  model.planes[0] = {arm, normal, depth, tissue};
  return model;
}

TEST(HapticModel, InFreeAirTheToolIsWhereTheDeviceIs) {
  const RigidPlace device{{0.1, -0.2, 0.3}, turn({0.3, 0.2, -0.1})};
  const HapticAnswer answer = solve_proxy(coupling(2000), device);
  EXPECT_NEAR(norm(answer.tool.position - device.position), 0, 1e-15);
  EXPECT_NEAR(norm(turn_of(answer.tool.axes) - turn_of(device.axes)), 0, 1e-14);
  EXPECT_NEAR(norm(answer.wrench.force), 0, 1e-10);
  EXPECT_NEAR(norm(answer.wrench.torque), 0, 1e-12);
}

TEST(HapticModel, TwoSpringsInSeries) {
  // Pressed 3 mm beyond a surface that was just touched: coupling and tissue share it.
  const HapticModel model = with_plane(2000, {}, {0, 0, -1}, 0, 500);
  const HapticAnswer answer = solve_proxy(model, {{0, 0, -0.003}, {}});
  const double both = 1 / (1.0 / 2000 + 1.0 / 500);
  EXPECT_NEAR(answer.wrench.force.z, both * 0.003, 1e-12);
  EXPECT_NEAR(answer.tool.position.z, -both * 0.003 / 500, 1e-15);
  EXPECT_NEAR(norm(solve_proxy(model, {{0, 0, 0.003}, {}}).wrench.force), 0, 1e-12) << "it does not stick";
}

TEST(HapticModel, AGapIsFree) {
  const HapticModel model = with_plane(2000, {}, {0, 0, -1}, -0.001, 500);
  EXPECT_NEAR(norm(solve_proxy(model, {{0, 0, -0.0009}, {}}).wrench.force), 0, 1e-12);
  EXPECT_GT(solve_proxy(model, {{0, 0, -0.002}, {}}).wrench.force.z, 0.1);
}

TEST(HapticModel, ALeverGivesTorque) {
  const HapticModel model = with_plane(2000, {0.02, 0, 0}, {0, 0, -1}, 0, 1e6);
  const HapticAnswer answer = solve_proxy(model, {{0, 0, -0.002}, {}});
  EXPECT_GT(answer.wrench.force.z, 0);
  // Rigid tissue: force and torque of the coupling balance one force at the arm's end.
  EXPECT_NEAR(answer.wrench.torque.y, -0.02 * answer.wrench.force.z, 1e-9);
}

/// Forces balance at the answer, whatever the planes: coupling pulls as planes push.
TEST(HapticModel, RandomPlanesAreInBalance) {
  Random random(3);
  for (int round = 0; round < 500; ++round) {
    HapticModel model = coupling(random.uniform(100, 5000));
    model.plane_count = 1 + random.index(static_cast<int>(kHapticPlanes));
    for (int i = 0; i < model.plane_count; ++i) {
      HapticPlane& p = model.planes[static_cast<std::size_t>(i)];
      p.normal = normalized({random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)});
      p.arm = {random.uniform(-0.02, 0.02), random.uniform(-0.02, 0.02), random.uniform(-0.02, 0.02)};
      p.depth = random.uniform(-0.002, 0.002);
      p.stiffness = random.uniform(100, 1e5);
    }
    const Vec3 to{random.uniform(-0.01, 0.01), random.uniform(-0.01, 0.01), random.uniform(-0.01, 0.01)};
    const Vec3 rotation{random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2)};
    const HapticAnswer answer = solve_proxy(model, {to, turn(rotation)});
    const Vec3 moved = answer.tool.position, turned = turn_of(answer.tool.axes);
    Vec3 force = -answer.wrench.force, torque = -answer.wrench.torque;  // on the tool
    double scale = norm(force);
    for (int i = 0; i < model.plane_count; ++i) {
      const HapticPlane& p = model.planes[static_cast<std::size_t>(i)];
      const double push = p.stiffness * std::fmax(0.0, p.depth + dot(p.normal, moved + cross(turned, p.arm)));
      force -= push * p.normal;
      torque -= cross(p.arm, push * p.normal);
      scale += push;
    }
    EXPECT_LT(norm(force), 1e-9 * (1 + scale)) << round;
    EXPECT_LT(norm(torque), 1e-9 * (1 + scale)) << round;
  }
}

TEST(HapticModel, ReductionKeepsTheForce) {
  Random random(5);
  std::vector<HapticContact> contacts;
  Vec3 sum;
  for (int i = 0; i < 200; ++i) {
    HapticContact c;
    c.point = {random.uniform(-0.01, 0.01), random.uniform(-0.01, 0.01), 0};
    c.normal = normalized({0.05 * random.uniform(-1, 1), 0.05 * random.uniform(-1, 1), -1});
    c.force = i % 3 == 0 ? random.uniform(0, 0.1) : 0;
    c.gap = c.force > 0 ? -1e-5 : random.uniform(0, 1e-3);
    sum += c.force * c.normal;
    contacts.push_back(c);
  }
  HapticModel model = coupling(2000);
  reduce_contacts(contacts, 300, model);
  EXPECT_EQ(model.plane_count, static_cast<std::int32_t>(kHapticPlanes));
  Vec3 kept;
  for (const HapticPlane& p : model.planes) kept += p.stiffness * std::fmax(0.0, p.depth) * p.normal;
  EXPECT_LT(norm(kept - sum), 0.05 * norm(sum));
  reduce_contacts({}, 300, model);
  EXPECT_EQ(model.plane_count, 0);
}

TEST(HapticModel, TheForceIsLimited) {
  HapticModel model = with_plane(2000, {}, {0, 0, -1}, 0, 1e6);
  model.max_force = 3;
  EXPECT_NEAR(norm(solve_proxy(model, {{0, 0, -0.1}, {}}).wrench.force), 3, 1e-12);
}

// For the thread sanitiser, too: what is read was written as a whole, and never gets older.
TEST(Latest, OneWritesOneReads) {
  struct Block {
    std::int64_t number = 0;
    std::array<std::int64_t, 40> copies{};
  };
  Latest<Block> latest;
  constexpr std::int64_t kRounds = 200000;
  std::thread writer([&] {
    Block b;
    for (std::int64_t i = 1; i <= kRounds; ++i) {
      b.number = i;
      b.copies.fill(i);
      latest.write(b);
    }
  });
  std::int64_t last = 0;
  bool good = true;
  while (last < kRounds) {
    bool fresh = false;
    const Block& b = latest.read(fresh);
    for (const std::int64_t c : b.copies) good = good && c == b.number;
    good = good && (fresh ? b.number > last : b.number == last);
    last = b.number;
  }
  writer.join();
  EXPECT_TRUE(good);
}

}  // namespace
}  // namespace kerf::haptic_model_test
