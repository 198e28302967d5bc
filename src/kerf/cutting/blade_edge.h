/// A blade's edge: a segment.
#pragma once

#include "kerf/base/result.h"
#include "kerf/base/vec.h"

namespace kerf {

/// A blade's edge at one moment, metres.
struct BladeEdge {
  Vec3 base, tip;
};

/// Bad input: an edge without length, or a coordinate that is not finite.
inline Status check_edge(const BladeEdge& edge) {
  if (!is_finite(edge.base) || !is_finite(edge.tip))
    return bad_input("blade: a coordinate of the edge is not a number");
  if (!(norm(edge.tip - edge.base) > 0))
    return bad_input("blade: base and tip are the same point; a blade needs an edge of some length");
  return {};
}

}  // namespace kerf
