// What tips over an edge.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "session/beam_strip.h"
#include "session/make_session.h"

namespace kerf::tipping_test {
namespace {

using namespace test::beam_strip;
using test::make;

/// Degrees that a stiff strip with its middle 20 mm beyond the edge of a box has turned by.
double tipped(double young, double dt, double seconds) {
  Scene scene = strip(young);
  scene.material.damping_mass = 0;
  scene.simulation.preconditioner = ScenePreconditioner::kAdaptive;
  scene.simulation.time_step = dt;
  SceneObstacle box;
  box.shape = SceneShape::kBox;
  box.size = {0.4, 0.4, 0.2};
  box.position = {-0.22, 0, -0.1 - kThickness / 2};
  box.friction = 0.5;
  scene.obstacles.push_back(box);
  Session session = make(scene);
  for (int i = 0; i < static_cast<int>(std::lround(seconds / dt)); ++i) EXPECT_TRUE(session.step().ok());
  Vec3 ends[2];
  int count[2] = {0, 0};
  const std::vector<Vec3>& rest = session.body().complex.collision.rest.raw();
  for (std::size_t i = 0; i < rest.size(); ++i)
    if (std::abs(std::abs(rest[i].x) - kLength / 2) < 1e-6) {
      ends[rest[i].x > 0] += session.collision_positions()[i];
      ++count[rest[i].x > 0];
    }
  const Vec3 along = (1.0 / count[1]) * ends[1] - (1.0 / count[0]) * ends[0];
  return std::atan2(-along.z, along.x) * 180 / M_PI;
}

// What a step stretched by turning it was taken for tension against turns: in steps of 16.7 ms a stiff strip never tipped over the edge.
TEST(Tipping, IsAsFastInLongSteps) {
  for (const double young : {2e7, 2e8}) {
    const double truth = tipped(young, 0.002, 0.3);
    EXPECT_GT(truth, 30);
    for (const double dt : {0.01, 1.0 / 60})
      EXPECT_NEAR(tipped(young, dt, 0.3), truth, 0.25 * truth) << young << " " << dt;
  }
}

}  // namespace
}  // namespace kerf::tipping_test
