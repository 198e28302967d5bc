// A vertex of the rim that is left between two cuts has one visual vertex for both sides. Before it can move into the material it gets two.
#pragma once

#include "kerf/binding/cell_complex.h"

namespace kerf::cut {

/// Splits the bound visual vertex of a rim vertex whose border edges both have walls: the + side keeps it, the - side gets a new one at the
/// same place, with an empty line between and one more face in each wall, of no area yet. Journaled. False, and nothing done, where the
/// vertex is not one of these.
bool split_rim_vertex(CellComplex& body, CollisionVertex v);

}  // namespace kerf::cut
