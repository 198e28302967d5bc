// Rigid shapes as triangles, for whoever draws or writes them.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kerf/base/vec.h"
#include "kerf/contact/rigid_shape.h"

namespace kerf {

/// |V| positions and |F| corners, counter-clockwise from outside.
struct ShapeMesh {
  std::vector<Vec3> positions;
  std::vector<std::array<std::int32_t, 3>> triangles;
};

/// The parts in the frame of their shape, one behind the other. Planes become squares of `plane_size` metres about their
/// point. Round things have about 24 corners around.
ShapeMesh shape_mesh(std::span<const ShapePart> parts, double plane_size);

}  // namespace kerf
