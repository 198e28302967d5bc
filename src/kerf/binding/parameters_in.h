// Binding parameters (equations 1 and 2 of the paper) as a query: they follow from planar coordinates, which never change.
#pragma once

#include <array>

#include "kerf/binding/cell_complex.h"

namespace kerf {

/// The weights (a, b, c), sum 1, of the collision triangle's corners that give the projected point of a visual corner:
/// v = a v1 + b v2 + c v3 (equation 1), on either side. `triangle` must be a part of the root triangle whose patch the corner's
/// face belongs to; weights outside [0, 1] mean that the point belongs to another part (equation 2 transforms between parts).
std::array<double, 3> parameters_in(const CellComplex& complex, VisualHalfEdge corner, CollisionTriangle triangle);

}  // namespace kerf
