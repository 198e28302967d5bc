// Where a rigid tool is, and how it moves.
#pragma once

#include "kerf/base/vec.h"

namespace kerf {

struct RigidState {
  Vec3 position;  ///< centre, m
  Mat3 axes;      ///< columns: the tool's axes in the world
  Vec3 velocity;  ///< m/s
  Vec3 spin;      ///< rad/s, world
  friend bool operator==(const RigidState&, const RigidState&) = default;
};

}  // namespace kerf
