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
/// a corner. It takes a part of the room beside the chord at most, as far as the two faces there reach.
void find_drawn_curve(CutContext& cut, CollisionHalfEdge h);

/// Makes the curve of scratch.curve a path of barrier edges in the patch on one side, laid onto the chord; inner vertices as walk_chord. Where parameters
/// find no room the path is the chord. False: nor does the chord. Free vertices that have changed sides stay in their lists until sort_free_beside.
bool walk_curve(CutContext& cut, CollisionHalfEdge h, Side side);

/// Puts the free vertices of the two faces beside an edge that curves have been walked along into the list of the face they are in.
void sort_free_beside(CutContext& cut, CollisionHalfEdge h);

}  // namespace kerf::cut
