// A strand that an edge has gone by uncut. Soft material gives way at the edge, so the last strand before a rim is stretched, and rolls on its side. The
// rim between two vertices of the collision mesh is then behind the edge, in the plane of the blade:
//
//      ----o-------------o----  rim                 x   edge, o tip
//           \           /                          / \.
//            \         /               ->    -----o---o-----  rim
//             \   o   /  tip
//                 x  edge
//
#pragma once

#include <span>

#include "kerf/binding/cell_complex.h"
#include "kerf/cutting/blade_edge.h"

namespace kerf {

/// The rim that the edge has left farthest behind itself, of those across from a tip, or none: where it crosses the plane of the blade it is more than
/// `least` metres behind. `into`: unit, where the edge goes. `position`: metres, per vertex. O(faces around the tip).
CollisionHalfEdge passed_rim(const CollisionMesh& mesh, std::span<const Vec3> position, CollisionVertex tip,
                             const BladeEdge& edge, Vec3 into, double least);

}  // namespace kerf
