// One side of the body: the part of its surface where the field is positive, cut out along the line where it is zero.
#pragma once

#include "kerf/midsurface/surface_mesh.h"

namespace kerf::mid {

struct SideSheet {
  SurfaceMesh mesh;             ///< with border: the middle of the rim
  Column<std::int32_t> parent;  ///< |F|: face of the working mesh
  Column<std::uint8_t> whole;   ///< |F|: the parent is not cut
};

/// Marching triangles at zero; field: |V|, none zero. sign: +1 or -1, the side. Always a manifold.
Result<SideSheet> cut_side(const SurfaceMesh& mesh, const Column<double>& field, double sign);

}  // namespace kerf::mid
