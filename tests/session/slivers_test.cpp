// Material that lies in a cell by less than a 20th of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "kerf/base/random.h"
#include "session/beam_strip.h"
#include "session/make_session.h"

namespace kerf::slivers_test {
namespace {

using namespace test::beam_strip;
using test::make;

// What lies in a cell by less than a 20th of it weighed on a neighbour but resisted nothing: 14 % more sag at 4.5 %.
TEST(Slivers, ResistAsAllMaterialDoes) {
  constexpr double young = 2e9;
  for (const double share : {0.03, 0.049, 0.055}) {
    Scene scene = strip(young);
    scene.lattice.origin->z -= share * kThickness;
    scene.lattice.cells = std::array<int, 3>{25, 3, 2};
    scene.fixes.push_back(left_of(-kLength / 2 + 3 * kCell));
    Session session = make(scene);
    const double truth = beam(young, kLength - 3 * kCell);
    EXPECT_NEAR(sag(session), truth, 0.02 * truth) << share;
  }
}

TEST(Slivers, BesideASlitResistOnTheirSide) {
  // A slit along the strip, 3 % of a cell beside a plane of the lattice: two beams, as wide as they are.
  constexpr double young = 2e9;
  Scene scene = strip(young);
  scene.fixes.push_back(left_of(-kLength / 2 + 3 * kCell));
  Session session = make(scene);
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, true).ok());
  const double y = -kWidth / 2 + 1.03 * kCell;
  for (const double x : {0.12, -kLength / 2 + 3 * kCell})
    ASSERT_TRUE(session.move_blade({x, y, 0.01}, {x, y, -0.01}).ok());
  ASSERT_TRUE(session.end_stroke().ok());
  const double truth = beam(young, kLength - 3 * kCell);
  EXPECT_NEAR(sag(session), truth, 0.02 * truth);
}

// A cut divides slivers anew, and their sum may be what it was to the bit. Taken back, their host kept the matrix of the divided ones.
TEST(Slivers, ACancelledCutLeavesTheirHostsAsTheyWere) {
  Scene scene;
  scene.name = scene.body.model = "steak";
  scene.simulation.preconditioner = ScenePreconditioner::kBlockJacobi;
  scene.fixes.push_back(left_of(-0.08));
  Session plain = make(scene), session = make(scene);
  Random random(11);
  for (int round = 0; round < 150; ++round) {
    ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, true).ok());
    const double x = random.uniform(-0.09, 0.09), y = random.uniform(-0.06, 0.06), angle = random.uniform(0, 6.28);
    for (int pose = 0; pose < 4; ++pose) {
      const double along = 0.01 * pose;
      const Vec3 at{x + along * std::cos(angle), y + along * std::sin(angle), 0};
      ASSERT_TRUE(session.move_blade(at + Vec3{0, 0, 0.04}, at - Vec3{0, 0, 0.04}).ok());
    }
    ASSERT_TRUE(session.cancel_stroke().ok());
    ASSERT_TRUE(session.step().ok());
    ASSERT_TRUE(plain.step().ok());
    ASSERT_EQ(session.hash(), plain.hash()) << "round " << round;
  }
}

}  // namespace
}  // namespace kerf::slivers_test
