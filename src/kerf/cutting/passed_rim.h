// A tip that an edge has pushed past the rim ahead of it. Soft material gives way at the edge, so the last strand before a rim is stretched; the rim
// between two vertices of the collision mesh stays behind, and the face between rim and tip turns inside out:
//
//      ----o-------------o----  rim                 o   tip
//           \           /                          / \.
//            \         /               ->    -----o---o-----  rim
//             \   o   /  tip
//
#pragma once

#include <span>

#include "kerf/binding/cell_complex.h"

namespace kerf {

/// The rim, or none: the border edge across from the tip in the face that is most inside out, seen along the edge of the blade (a unit vector), if those
/// between the tip and rims are so on the whole, and the others around it are not. `position`: metres, per vertex. O(faces around the tip).
CollisionHalfEdge passed_rim(const CollisionMesh& mesh, std::span<const Vec3> position, CollisionVertex tip,
                             Vec3 along);

}  // namespace kerf
