// Folds of an open sheet that no collision mesh of it can have: edges where it lies back on itself (kFoldCosine). They are found on the sheet itself.
#pragma once

#include <cstddef>

#include "kerf/base/result.h"
#include "kerf/mesh/triangle_mesh.h"

namespace kerf {

/// Bad input, with the angle and a place, for folds that a collision mesh of about so many triangles can't round off: those that hang together
/// reach further than kLongFold of its edges. collision_triangles 0: the sheet is its own, and rounds nothing off. Near linear time.
Status check_sheet_folds(const TriangleMesh& sheet, std::size_t collision_triangles);

/// The same for folds of any length near a place where a collision mesh of so many triangles does not bind (kFaultReach).
Status check_sheet_folds_near(const TriangleMesh& sheet, std::size_t collision_triangles, Vec3 place);

}  // namespace kerf
