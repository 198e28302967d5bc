// Puts the rim of the collision mesh onto the very surface that came in, where a filtered or coarser copy was used.
#pragma once

#include <vector>

#include "kerf/midsurface/remesh.h"

namespace kerf::mid {

/// Border vertices move to the closest point of `surface` (positions in the frame of the mesh), if that is within a half
/// thickness or half an edge. Linear in the surface with a small factor: most of it is far from the rim.
void snap_border(CoarseMesh& mesh, const std::vector<Vec3>& positions, const TriangleMesh& surface);

}  // namespace kerf::mid
