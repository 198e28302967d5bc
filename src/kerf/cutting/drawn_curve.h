// The curve that a blade drew, where the collision mesh is cut along a chord (docs/cutting.md, "The visual mesh").
//
//   in space                    in the plane of the root triangle
//        __----__   curve
//     p /        \ q               p ---------------- q   the chord, and the curve laid onto it
//
// The visual mesh is cut along the curve. Then parameters beside it, never places, are moved so that it lies on the chord.
#pragma once

#include "kerf/cutting/cut_context.h"

namespace kerf::cut {

/// The part of CutContext::drawn between the ends of a collision edge that owns no chain yet, in scratch.curve: points (metres along the edge, metres to
/// its left), none if a chord would not show. Where the path's vertices were rounded to another place, the curve leaves the drawn places towards them without
/// a corner. It takes a part of the room beside the chord at most, up to the next chains.
void find_drawn_curve(CutContext& cut, CollisionHalfEdge h);

/// Makes the curve of scratch.curve a path of barrier edges in the patch on one side, laid onto the chord; inner vertices as walk_chord. Where parameters
/// find no room the path is the chord. False: nor does the chord. Free vertices go into the lists of the faces they come into.
bool walk_curve(CutContext& cut, CollisionHalfEdge h, Side side);

}  // namespace kerf::cut
