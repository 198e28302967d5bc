// How far re-meshing may move what it inserts into an edge of the visual surface.
#pragma once

#include <algorithm>

#include "kerf/binding/tolerances.h"

namespace kerf {

/// As parts of an edge.
struct Margins {
  double snap = 0;  ///< nearer to a free vertex than this: goes there
  double wall = 0;  ///< distance kept from a vertex on a wall

  /// Of an edge of this length, where collision edges have this mean length, metres.
  static Margins of(double length, double mean_collision_edge) {
    const double most = kMostShift * mean_collision_edge / length;
    return {std::min(kSnapFraction, most), std::min(kWallMargin, most)};
  }
};

}  // namespace kerf
