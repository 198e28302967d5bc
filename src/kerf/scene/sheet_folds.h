// Folds of an open sheet that no collision mesh of it can have: found on the sheet itself, before one is made.
#pragma once

#include <cstddef>

#include "kerf/base/result.h"
#include "kerf/mesh/triangle_mesh.h"

namespace kerf {

/// Bad input, with the angle and a place: an edge where the sheet lies back on itself (kFoldCosine), or, where a collision mesh of about
/// so many triangles is made of it, such edges that together are longer than two of that mesh; shorter folds are rounded off.
/// collision_triangles 0: the sheet is its own. Near linear time.
Status check_sheet_folds(const TriangleMesh& sheet, std::size_t collision_triangles);

}  // namespace kerf
