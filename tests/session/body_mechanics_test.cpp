#include "kerf/session/body_mechanics.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kerf/base/random.h"
#include "kerf/session/session.h"

namespace kerf::body_mechanics_test {
namespace {

// Of v = G x every cell has the gradient G, whatever way the lattice lies.
TEST(DeformationRate, IsTheNormOfTheGradient) {
  Scene scene;
  scene.name = scene.body.model = "strip";
  scene.body.rotation = {0.3, -0.4, 1};
  const auto session = Session::create(scene);
  ASSERT_TRUE(session.ok()) << session.error().message;
  const HexMesh& hex = session->body().hex;
  Random random(3);
  for (int round = 0; round < 20; ++round) {
    Mat3 gradient;
    double square = 0;
    for (auto& column : gradient.c)
      for (int a = 0; a < 3; ++a) {
        column[a] = random.uniform(-50, 50);
        square += column[a] * column[a];
      }
    std::vector<Vec3> velocities;
    for (const Vec3 x : session->node_positions()) velocities.push_back(gradient * x);
    const double expected = std::sqrt(square);
    for (const double least : {0.0, 0.99 * expected})
      EXPECT_NEAR(deformation_rate(hex, velocities, least), expected, 1e-9 * expected);
  }
  EXPECT_EQ(deformation_rate(hex, std::vector<Vec3>(session->node_positions().size(), Vec3{1, 2, 3}), 1), 0);
}

// A scrap that falls turning by more than half a radian in a step: the step is divided, and the report says so.
TEST(DeformationRate, LongStepsOfWhatTurnsFastAreDivided) {
  const auto parts_at = [](double dt) {
    Scene scene;
    scene.name = scene.body.model = "strip";
    scene.simulation.time_step = dt;
    scene.simulation.gravity = {};
    SceneGrasp end;
    end.id = "end";
    end.point = {0.1, 0, 0};
    end.radius = 0.01;
    SceneMove pull;
    pull.id = "end";
    pull.by = {-0.1, 0, 0.1};
    pull.over = 0.04;
    scene.commands = {{0, end}, {0, pull}};
    auto session = Session::create(scene);
    EXPECT_TRUE(session.ok());
    int most = 0;
    for (int i = 0; i * dt < 0.1; ++i) {
      const auto step = session->step();
      EXPECT_TRUE(step.ok());
      most = std::max(most, step->parts);
    }
    return most;
  };
  EXPECT_GT(parts_at(0.02), 1);
  EXPECT_EQ(parts_at(0.0005), 1);
}

}  // namespace
}  // namespace kerf::body_mechanics_test
