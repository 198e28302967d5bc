// What fixed regions hold is material: answers do not hang on where cells end.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "session/beam_strip.h"
#include "session/make_session.h"

namespace kerf::held_material_test {
namespace {

using namespace test::beam_strip;
using test::make;

// Only nodes in the region were held: up to a cell less of the strip, and 20 % more sag here.
TEST(HeldMaterial, ABeamIsAsLongAsItIsFree) {
  constexpr double young = 2e9;
  for (const double share : {0.0, 0.02, 0.4, 0.98}) {
    Scene scene = strip(young);
    const double border = -kLength / 2 + kCell * (3 + share);
    scene.fixes.push_back(left_of(border));
    Session session = make(scene);
    const double truth = beam(young, kLength / 2 - border), got = sag(session);
    EXPECT_NEAR(got, truth, 0.03 * truth) << share;
    const double weight = kWeight * kLength * kWidth * kThickness;
    EXPECT_NEAR(session.support_force().z, weight, 0.01 * weight) << share;
    const auto kept = session.snapshot();
    session.restore(kept);
    ASSERT_TRUE(session.step().ok());
    EXPECT_NEAR(session.support_force().z, weight, 0.01 * weight) << share;
    EXPECT_TRUE(session.validate().ok());
  }
}

TEST(HeldMaterial, LessThanACellIsHeldWhereItIs) {
  constexpr double young = 2e9;
  Scene scene = strip(young);
  SceneFix fix;
  fix.region.min = {-kLength / 2 - 1, -1, -1};
  fix.region.max = {-kLength / 2 + 0.3 * kCell, 1, 1};
  scene.fixes.push_back(fix);
  Session session = make(scene);
  const double truth = beam(young, kLength - 0.3 * kCell);
  EXPECT_NEAR(sag(session), truth, 0.03 * truth);
}

TEST(HeldMaterial, UnfixLetsGoOfIt) {
  Scene scene = strip(2e9);
  scene.fixes.push_back(left_of(-kLength / 2 + 3.4 * kCell));
  SceneCommand command;
  command.at = 0.1;
  SceneUnfix unfix;
  unfix.region = left_of(-kLength / 2 + 4 * kCell).region;
  command.what = unfix;
  scene.commands.push_back(command);
  Session session = make(scene);
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(session.step().ok());
  EXPECT_LT(norm(session.support_force()), 1e-12);
  double highest = -HUGE_VAL;
  for (const Vec3 x : session.collision_positions()) highest = std::max(highest, x.z);
  EXPECT_LT(highest, -0.01);  // all of it falls
}

TEST(HeldMaterial, ACutThroughItLeavesBothPartsHeld) {
  Scene scene = strip(1e6);
  scene.fixes.push_back(left_of(-kLength / 2 + 3.4 * kCell));
  Session session = make(scene);
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, true).ok());
  for (const double x : {-0.12, 0.12}) ASSERT_TRUE(session.move_blade({x, 0.001, 0.01}, {x, 0.001, -0.01}).ok());
  ASSERT_TRUE(session.end_stroke().ok());
  EXPECT_EQ(session.counts().pieces, 2);
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(session.step().ok());
  double moved = 0;
  for (std::size_t i = 0; i < session.collision_positions().size(); ++i)
    if (const Vec3 rest = session.body().complex.collision.rest.raw()[i]; rest.x < -kLength / 2 + 3.4 * kCell)
      moved = std::max(moved, norm(session.collision_positions()[i] - rest));
  EXPECT_LT(moved, 1e-3);
  EXPECT_TRUE(session.validate().ok());
}

TEST(HeldMaterial, WhatIsHeldByALineIsNoted) {
  for (const bool line : {true, false}) {
    Scene scene = strip(1e6);
    SceneFix fix;
    fix.region.min = {-kLength / 2 - 1e-6, -1, line ? -kThickness / 2 - 1e-6 : -1};
    fix.region.max = {-kLength / 2 + 1e-6, 1, line ? -kThickness / 2 + 1e-6 : 1};
    scene.fixes.push_back(fix);
    const Session session = make(scene);
    EXPECT_EQ(std::any_of(session.notes().begin(), session.notes().end(),
                          [](const std::string& note) { return note.find("can turn about that line") != note.npos; }),
              line);
  }
}

}  // namespace
}  // namespace kerf::held_material_test
