// Material that lies in a cell by less than a 20th of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

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

}  // namespace
}  // namespace kerf::slivers_test
