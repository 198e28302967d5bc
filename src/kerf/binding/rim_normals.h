// Normals of the mid-surface at its border: along the body's side, so that what is above the rim is the side's upper edge.
#pragma once

#include <span>

#include "kerf/binding/bound_vertices.h"
#include "kerf/binding/split_surface.h"

namespace kerf {

/// Turns normals at the border of a closed body, across the rim, until they lie in the body's side there: where the body is bent, or its side is
/// not upright on it, the normal of the last triangles does not. Where no side is steep, at sharp rims, normals stay. `normals`: |V collision|,
/// unit. Cost: the faces of sides within half a thickness or so of bound points.
void lean_with_sides(const SplitSurface& surface, const CollisionMesh& collision, const BoundVertices& vertices, std::span<Vec3> normals);

}  // namespace kerf
