/// A blade's edge: a segment.
#pragma once

#include "kerf/base/vec.h"

namespace kerf {

/// A blade's edge at one moment, metres.
struct BladeEdge {
  Vec3 base, tip;
};

}  // namespace kerf
