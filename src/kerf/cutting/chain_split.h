// Chains: the visual edges under a root edge or cut edge of the collision mesh.
#pragma once

#include "kerf/cutting/cut_context.h"
#include "kerf/cutting/visual_split.h"

namespace kerf::cut {

/// Position of chain vertex v along collision edge h, 0 at its start and 1 at its end.
double chain_parameter(const CellComplex& body, CollisionHalfEdge h, Side side, VisualVertex v);

/// The visual half-edge between neighbours u, w of a chain (in the order of h) on h's side of it; none: broken chain.
VisualHalfEdge chain_half_edge(const VisualMesh& mesh, Side side, VisualVertex u, VisualVertex w);

/// A new vertex on the visual edge u - w of h's chain, `fraction` between u and w in 3D, exactly at u_left in the plane
/// of h's triangle and u_right in its twin's (+ side coordinates). None after a failure.
VisualVertex insert_in_chain(CutContext& cut, CollisionHalfEdge h, Side side, VisualVertex u, VisualVertex w,
                             double fraction, Vec2 u_left, Vec2 u_right);

struct ChainCut {
  VisualVertex vertex;          ///< the vertex at the cut; none after a failure
  std::int32_t before = 0;      ///< inner vertices before it
  std::int32_t after_from = 0;  ///< the rest of the chain starts here
};
/// Cuts the chain of h at parameter t: an inner chain vertex nearby slides there, or the visual edge is split. On the
/// rim of a closed body one vertex serves both sides. Cost: O(log chain length) fans.
ChainCut cut_chain(CutContext& cut, CollisionHalfEdge h, Side side, double t, Vec2 u_left, Vec2 u_right);

}  // namespace kerf::cut
