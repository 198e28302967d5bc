// How many cells of a lattice will hold material: before any is made.
#pragma once

#include <cstddef>

#include "kerf/lattice/lattice_frame.h"

namespace kerf {

/// About so many cells meet the prisms of a collision mesh, all of the box at most. A convex body meets, on the mean over its places, as many
/// unit cells as its volume and its areas seen along the three axes add up to, in cells. Bodies whose sides lie in lattice planes meet fewer, down
/// to half for one layer. Cost: linear in triangles, whatever the lattice.
std::size_t count_material_cells(const CollisionMesh& mesh, const LatticeFrame& frame);

}  // namespace kerf
