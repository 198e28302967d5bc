// A strip and a scalpel before its side, for tests of blades.
#pragma once

#include <array>
#include <numbers>

#include "kerf/session/session.h"

namespace kerf::testing_support {

/// A scalpel whose edge stands upright and faces +y: its own y points along -x.
inline constexpr Vec3 kFacingY{0, 0, std::numbers::pi / 2};

/// A strip along x, 24 mm wide and 3 mm thick, without weight, and a scalpel "tool" that is about to cut across at x.
inline Scene blade_strip(double time_step, double x) {
  Scene scene;
  scene.body.model = "strip";
  scene.body.options.visual_triangles = 1000;
  scene.lattice.cells = std::array<int, 3>{50, 8, 1};
  scene.simulation.time_step = time_step;
  scene.simulation.gravity = {};
  scene.material.young = 1e5;
  SceneRigidTool tool;
  tool.id = "tool";
  tool.kind = SceneToolKind::kScalpel;
  tool.position = {x, -0.02, -0.012};
  tool.rotation = kFacingY;
  scene.tools = {tool};
  return scene;
}

}  // namespace kerf::testing_support
