// How far the columns of a new wall bow, so that the wall stays in the body.
//
// A column is straight where nothing is in its way. Beside a hollow side its middle goes over the mid-surface:
//
//     above _________               above _________
//              |     \  rim                 \     \  rim
//     straight |      )  side          bowed <     )  side
//              |     /                      /     /
//     below ___|____/               below _/_____/
#pragma once

#include "kerf/cutting/cut_context.h"

namespace kerf::cut {

/// Fills scratch.bow: metres, for every column of h from start to end, from the middle of the straight column to the one it
/// takes. Reads the chains with their ends in scratch.chain and the visual half-edges along them in scratch.left and
/// scratch.right. All zero for most walls. Cost: the columns of h.
void find_wall_bows(CutContext& cut, CollisionHalfEdge h);

/// Share of a column's bow at a depth, 0 at the + chain and 1 at the - chain: all of it half-way down.
inline double bow_share(double depth) { return depth < 0.5 ? 2 * depth : 2 * (1 - depth); }

}  // namespace kerf::cut
