// Which points of the visual surface belong to the collision vertices (4.1.1), and how thick the body is there.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/binding/cell_complex.h"
#include "kerf/binding/skin_search.h"
#include "kerf/binding/split_surface.h"

namespace kerf {

struct BoundVertices {
  std::vector<std::array<std::int32_t, 2>>
      bound;                           ///< |V collision|: visual vertex per side; equal on the rim; open: [-] is -1
  std::vector<double> half_thickness;  ///< |V collision|, metres
  int inserted = 0;                    ///< points that became new visual vertices
  int snapped = 0;                     ///< points that took an existing vertex
  std::vector<std::string> warnings;
};

/// A collision mesh folded over itself claims one part of the body twice: bad input, naming the edge. at_fault: receives its ends.
Status check_folds(const CollisionMesh& collision, std::vector<CollisionVertex>* at_fault = nullptr);

/// Binds every collision vertex of a closed body: inner ones to the first exits of the rays along +- normal, border ones
/// to the rim. Splits faces and edges of `surface`; marks bound vertices as wall vertices. `search` is over the faces of
/// the surface before any split. Where rays of fine triangles cross on their way out of thick parts, `normals` (of the vertices) are made
/// smoother. Bad input names the collision vertex (1-based).
Result<BoundVertices> bind_closed(SplitSurface& surface, const SkinSearch& search, const CollisionMesh& collision,
                                  std::span<Vec3> normals, std::vector<CollisionVertex>* at_fault = nullptr);

/// The same for an open sheet: inner vertices to the closest points, border vertices to the closest points of the border
/// loop that corresponds, in order along it. Half the thickness everywhere.
Result<BoundVertices> bind_open(SplitSurface& surface, const SkinSearch& search, const CollisionMesh& collision,
                                double thickness);

/// Border loops of half-edge arrays as vertex lists in the direction of their half-edges.
std::vector<std::vector<std::int32_t>> border_loops(std::span<const std::int32_t> origin,
                                                    std::span<const std::int32_t> twin);

}  // namespace kerf
