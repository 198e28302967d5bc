// Walls: the strips of cut surface of a closed body. A wall is a patch with its own plane (column index, -layer),
// seen from outside: + side up, the start of its border edge on the left.
#pragma once

#include "kerf/cutting/cut_context.h"

namespace kerf::cut {

/// Gives both chains of h the same number of inner vertices, at least one if `force_column`: pairs parameters closer
/// than kPairFraction of the smallest gap beside them, inserts the others in the other chain. Sets the chains of h
/// and of its twin.
bool merge_columns(CutContext& cut, CollisionHalfEdge h, bool force_column);

/// Inner vertices of the line of a fresh tip, from bound[+] to bound[-]: layers - 1 new visual vertices.
PoolRun make_line(CutContext& cut, std::array<VisualVertex, 2> bound);

/// Spans the walls of h (just unlinked, with the chains as they are now) and of g, its former twin, mirrored: same 3D
/// points, mirrored diagonals. scratch.left/right hold the visual half-edges along the chains of h and g (in the order
/// of h), scratch.down/up those along the opened lines at the start and the end of h (empty: tip, or rim): at the
/// start `up` is on h's side and `down` on g's, at the end the other way round.
/// scratch.chain: both chains with their ends.
void build_walls(CutContext& cut, CollisionHalfEdge h, CollisionHalfEdge g);

/// Cuts a wall from bound[+] to bound[-], two vertices of its chains; returns the new wall of the half towards the end of
/// its border edge (none after a failure) and the line between the halves.
WallId cut_wall(CutContext& cut, WallId wall, std::array<VisualVertex, 2> bound, PoolRun& line);

}  // namespace kerf::cut
