// The border of a collision mesh, fitted to the side of a closed body: its vertices stand on the rim, and its prisms along the side.
#pragma once

#include <cstdint>
#include <span>

#include "kerf/base/result.h"
#include "kerf/binding/bound_vertices.h"
#include "kerf/binding/cell_complex.h"
#include "kerf/binding/split_surface.h"

namespace kerf {

/// May a triangle with one area vector get another one? It is neither turned nor flattened by that (kLeadTurnCosine, kLeadShrink).
bool stays_upright(Vec3 before, Vec3 after);

/// Moves border vertices that are near their bound points to them and lays the root planes out again; ids stay. Vertices of triangles that
/// this would turn or flatten stay too. Returns how many moved noticeably (kLedNoticeably).
Result<std::int64_t> lead_border(CollisionMesh& collision, const SplitSurface& surface, const BoundVertices& vertices);

/// Turns the normals of border vertices until they are at right angles to the side of the body: a mid-surface that is bent has a normal
/// at its border that isn't. `surface`: with its real positions. Where the side is sharp, without steep faces, normals stay.
void lean_border_normals(const CollisionMesh& collision, const SplitSurface& surface, const BoundVertices& vertices,
                         std::span<Vec3> normals);

}  // namespace kerf
