// Splitting edges and faces of the collision mesh, each mirrored on the visual mesh and the walls, and Delaunay flips.
#pragma once

#include <span>

#include "kerf/cutting/cut_context.h"

namespace kerf::cut {

/// Splits the collision edge h = a -> b at fraction t; h becomes a -> m. The new vertex has bound visual vertices (on a
/// border made by a cut in a closed body also a line, and the wall is cut in two). None after a failure.
CollisionVertex split_collision_edge(CutContext& cut, CollisionHalfEdge h, double t);

/// Splits the triangle f at u (planar, strictly inside) with barycentric weights `weights`. None after a failure.
CollisionVertex split_collision_face(CutContext& cut, CollisionTriangle f, Vec2 u,
                                     const std::array<double, 3>& weights);

/// Flips chainless edges inside root triangles until they are Delaunay, starting from scratch.flip_stack; not those of the faces `keep`.
void flip_to_delaunay(CutContext& cut);
void flip_to_delaunay(CutContext& cut, std::span<const CollisionTriangle> keep);

}  // namespace kerf::cut
