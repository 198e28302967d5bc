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

/// A rim that an edge has gone by, and the vertex of the cut's lips from which it is parted: the tip, or one beside it where the strand is thinner.
struct PassedRim {
  CollisionVertex from;
  CollisionHalfEdge rim;
  [[nodiscard]] bool exists() const { return rim.valid(); }
};

/// An edge that goes by.
struct PassingEdge {
  BladeEdge edge;
  Vec3 into;          ///< unit, where it goes
  double least = 0;   ///< metres: a rim that is not farther behind, in the plane of the blade, counts as ahead
  double around = 0;  ///< metres at rest: lips so near to a tip are looked at too
};

/// The rim that the edge has left farthest behind itself, of those across from a tip and from its lips, or none. Strands are ahead of a tip at rest: the
/// rim that its path came in through is not one. `position`: metres, per vertex. Cost: the
/// faces around those vertices.
PassedRim passed_rim(const CollisionMesh& mesh, std::span<const Vec3> position, CollisionVertex tip,
                     const PassingEdge& passing);

}  // namespace kerf
