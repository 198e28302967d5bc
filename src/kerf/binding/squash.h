// The visual surface of a closed body pressed onto its mid-surface, along the prisms of the collision mesh. Paths and parameters are found
// on the pressed surface: what stands above a place of the mid-surface gets that place's parameters, at the rim too, where half of
// the side wall belongs to each triangle of the border.
#pragma once

#include <cstdint>
#include <span>

#include "kerf/binding/bound_vertices.h"
#include "kerf/binding/cell_complex.h"
#include "kerf/binding/split_surface.h"

namespace kerf {

/// Moves every vertex to its place in a prism, at kSquash of its height; `upright` keeps the real positions. `normals`: of the collision
/// vertices, unit. A vertex starts in the prism of the vertex it is reached from, breadth first from the bound vertices, so that layers that come
/// near each other are not mixed up. Beyond the rim the last prism is extended. The same bits for any number of threads.
/// Returns how many vertices stand where the normals of a prism cross: they are projected along its triangle's normal.
std::int64_t squash(SplitSurface& surface, const CollisionMesh& collision, const BoundVertices& vertices,
                    std::span<const Vec3> normals);

/// Gives the vertices, and those that came of splits in between, their real positions back.
void stand_up(SplitSurface& surface);

}  // namespace kerf
