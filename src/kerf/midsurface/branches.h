// Where a body branches. Across the fork of a branch the way from a point to the one opposite to it jumps: neighbours see
// parts of the other side that do not hang together, or the sides change where neither is at the end of the sheet.
#pragma once

#include "kerf/midsurface/side_labels.h"

namespace kerf::mid {

struct Branches {
  std::vector<std::uint8_t> flag;  ///< |F|: at such an edge
  double length = 0;               ///< of all such edges, metres
};

/// Looks at every edge between faces that are sure of what lies opposite. Edges of rims, knife edges and creases are none.
/// Linear but for short searches at creases.
Branches find_branches(const SurfaceMesh& mesh, const Pairing& pairing, const SideLabels& labels);

}  // namespace kerf::mid
