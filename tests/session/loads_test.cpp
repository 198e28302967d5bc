// Where loads act.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "session/beam_strip.h"
#include "session/make_session.h"

namespace kerf::loads_test {
namespace {

using namespace test::beam_strip;
using test::make;

// The vertex nearest to the point may belong to the other lip.
TEST(Loads, ActOnTheLipThatTheyAreOn) {
  for (const double y : {-0.0008, -0.0003, 0.0003, 0.0008}) {
    Scene scene = strip(1e5);
    scene.simulation.gravity = {};
    scene.fixes.push_back(left_of(-kLength / 2 + 3 * kCell));
    SceneLoad load;
    load.point = {kLength / 2, y, 0};
    load.force = {0, 0, 1e-4};
    load.from = 0.005;
    scene.loads.push_back(load);
    Session session = make(scene);
    ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, true).ok());
    for (const double x : {0.12, 0.03}) ASSERT_TRUE(session.move_blade({x, 0, 0.01}, {x, 0, -0.01}).ok());
    ASSERT_TRUE(session.end_stroke().ok());
    for (int i = 0; i < 10; ++i) ASSERT_TRUE(session.step().ok());
    double moved[2] = {0, 0};
    const std::vector<Vec3>& rest = session.body().complex.collision.rest.raw();
    for (std::size_t i = 0; i < rest.size(); ++i)
      if (rest[i].x > kLength / 2 - 1e-6 && std::abs(rest[i].y) > 0.004) {
        double& side = moved[rest[i].y > 0 ? 1 : 0];
        side = std::max(side, session.collision_positions()[i].z - rest[i].z);
      }
    EXPECT_GT(moved[y > 0 ? 1 : 0], 2 * moved[y > 0 ? 0 : 1]) << y;
  }
}

}  // namespace
}  // namespace kerf::loads_test
