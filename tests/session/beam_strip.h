// The strip as a beam: cells of 8 mm, no Poisson's ratio, damped until it hangs still.
#pragma once

#include <gtest/gtest.h>

#include <cmath>

#include "kerf/session/session.h"

namespace kerf::test::beam_strip {

inline constexpr double kLength = 0.2, kWidth = 0.024, kThickness = 0.003, kCell = 0.008, kWeight = 9810;  // m, N/m3

/// The strip of 200 x 24 x 3 mm in cells of 8 mm that damping brings to rest.
inline Scene strip(double young) {
  Scene scene;
  scene.body.model = "strip";
  scene.body.options.visual_triangles = 0;
  scene.material.young = young;
  scene.material.poisson = 0;
  scene.material.density = 1000;
  scene.material.damping_mass = 30;
  scene.lattice.origin = Vec3{-kLength / 2, -kWidth / 2, -kThickness / 2};
  scene.lattice.cell_size = Vec3{kCell, kCell, kThickness};
  scene.lattice.cells = std::array<int, 3>{25, 3, 1};
  scene.simulation.time_step = 0.01;
  scene.simulation.preconditioner = ScenePreconditioner::kDirect;
  return scene;
}
inline SceneFix left_of(double x) {
  SceneFix fix;
  fix.region.shape = SceneRegion::Shape::kHalfSpace;
  fix.region.point = {x, 0, 0};
  fix.region.normal = {-1, 0, 0};
  return fix;
}
/// m: how far the right end has gone down after a while.
inline double sag(Session& session, int steps = 150) {
  for (int i = 0; i < steps; ++i) {
    const auto done = session.step();
    EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().message);
  }
  double sum = 0;
  int count = 0;
  const std::vector<Vec3>& rest = session.body().complex.collision.rest.raw();
  for (std::size_t i = 0; i < rest.size(); ++i)
    if (rest[i].x > kLength / 2 - 1e-6) {
      sum += rest[i].z - session.collision_positions()[i].z;
      ++count;
    }
  return sum / count;
}
/// A beam of this length under its own weight.
inline double beam(double young, double length) {
  return kWeight * std::pow(length, 4) * 12 / (8 * young * kThickness * kThickness);
}

}  // namespace kerf::test::beam_strip
