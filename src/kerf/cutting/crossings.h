// Where the drawn surface of a body at rest passes through itself: walls through the skin, walls through each other.
#pragma once

#include "kerf/binding/cell_complex.h"
#include "kerf/spatial/self_intersections.h"

namespace kerf {

/// Of all visual triangles, neighbours too. The two lips of a cut lie in each other and do not count.
SelfIntersections crossings_of(const CellComplex& body);

}  // namespace kerf
