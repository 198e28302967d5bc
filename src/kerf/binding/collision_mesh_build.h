// The collision mesh of a body before any cut: half-edges, root planes, prism offsets.
#pragma once

#include <span>

#include "kerf/base/result.h"
#include "kerf/binding/cell_complex.h"
#include "kerf/mesh/triangle_mesh.h"

namespace kerf {

/// Area-and-angle-neutral vertex normals (angle weighted), unit, |V|.
std::vector<Vec3> vertex_normals(const TriangleMesh& mesh);

/// Connects `surface` and lays every triangle out in its own root plane (isometric: corner 0 at the origin, corner 1
/// on the +x axis). offset[v] = normal x half_thickness[v]; half_thickness has one value per vertex, metres, >= 0.
/// Ids are those of `surface`. Chains, bound vertices and free lists are left "none" for the binding to fill.
/// Bad input: not an oriented manifold, a triangle without area.
Result<CollisionMesh> build_collision_mesh(const TriangleMesh& surface, std::span<const double> half_thickness);

/// Metres; inner edges count twice.
double mean_edge(const CollisionMesh& mesh);

}  // namespace kerf
