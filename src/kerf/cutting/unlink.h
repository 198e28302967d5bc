// Opening an edge of the cut path: collision mesh, visual mesh and walls together (4.2.2).
#pragma once

#include "kerf/cutting/cut_context.h"

namespace kerf::cut {

/// Makes the chains of an inner edge that owns none: along the curve of CutContext::drawn, or the chord.
bool make_chains(CutContext& cut, CollisionHalfEdge h);

/// Makes the inner collision edge h = a -> b a pair of border edges. One rule serves all junctions: an end falls apart
/// exactly when it was on a border before (the fan on the right of h gets a new vertex, the left keeps its ids); an
/// end that was not on a border becomes a tip and, in a closed body, gets its line through the thickness.
bool unlink_edge(CutContext& cut, CollisionHalfEdge h);

}  // namespace kerf::cut
