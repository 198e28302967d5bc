// The surface pressed onto its mid-surface: what lies above each other comes to one place, so that paths between bound vertices run where
// the collision mesh's edges are, and parameters are places in the mid-surface (docs/binding.md, "Squashed").
#pragma once

#include <span>

#include "kerf/binding/bound_vertices.h"
#include "kerf/binding/split_surface.h"

namespace kerf {

/// Moves every vertex of a closed body's surface along the mid-surface's normals to where they meet the mid-surface (beyond the rim: the
/// plane of the last triangle), but for kSquash of its height: sides that stand upright keep a little width, and every triangle an area. Where
/// vertices were is kept in `surface.upright`, which must be empty before. `normals`: |V collision|, unit. `vertices`: where the surface is
/// known to belong to which part of the mid-surface; it must be connected. Linear time.
void squash(SplitSurface& surface, const CollisionMesh& collision, const BoundVertices& vertices, std::span<const Vec3> normals);

/// Puts every vertex back where it was.
void unsquash(SplitSurface& surface);

}  // namespace kerf
