// The free visual vertices of collision triangles: split in place when a triangle is split.
#pragma once

#include "kerf/cutting/cut_context.h"

namespace kerf::cut {

/// Divides the lists of `from` (as they were before it was split, both sides) among `into[0..n-1]`, which now cover it,
/// by exact tests against rays from vertex position m to corner[i]: into[i] lies between the rays to corner[i] and
/// corner[i+1] (counter-clockwise). For n == 2 the only ray is m -> corner[1]: into[0] on its right.
/// Vertices that are no longer free are dropped.
void divide_free_lists(CutContext& cut, std::array<PoolRun, 2> lists, const CollisionTriangle* into, int n, Vec2 m,
                       const Vec2* corner);

/// The lists of two triangles together, for a flip.
std::array<PoolRun, 2> joined_free_lists(CutContext& cut, CollisionTriangle a, CollisionTriangle b);

/// Adds a vertex to the list of a triangle. Cost: the list.
void add_free(CutContext& cut, CollisionTriangle f, Side side, VisualVertex v);

}  // namespace kerf::cut
