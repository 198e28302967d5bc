// What fades at a surface vertex after a cut (surface_fade.h).
#pragma once

#include <cstdint>

#include "kerf/base/vec.h"

namespace kerf {

/// What a vertex' place and velocity have in addition to those of its copy. Metres, m/s.
struct FadingVertex {
  std::int32_t vertex = 0;
  Vec3 offset, velocity;
  friend bool operator==(const FadingVertex&, const FadingVertex&) = default;
};

}  // namespace kerf
