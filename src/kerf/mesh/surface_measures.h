// What a triangle surface is made of: counts, sizes, topology. Works on broken surfaces too.
#pragma once

#include <cstddef>
#include <cstdint>

#include "kerf/base/vec.h"
#include "kerf/mesh/triangle_mesh.h"

namespace kerf {

struct SurfaceMeasures {
  std::size_t vertices = 0;  ///< used by a triangle
  std::size_t unused_vertices = 0;
  std::size_t edges = 0;
  std::size_t triangles = 0;
  std::size_t border_edges = 0;        ///< with one triangle
  std::size_t border_loops = 0;        ///< connected sets of border edges
  std::size_t non_manifold_edges = 0;  ///< with more than two triangles
  std::size_t unoriented_edges = 0;    ///< whose two triangles run along it the same way
  std::size_t components = 0;          ///< joined by edges
  std::int64_t euler = 0;              ///< vertices - edges + triangles
  bool closed = false;                 ///< every edge has two triangles, consistently oriented
  double area = 0;                     ///< m^2
  double volume = 0;  ///< m^3, signed: positive when triangles are counter-clockwise from outside; 0 if not closed
  Box3 box;           ///< of the used vertices, metres
};

/// Measures a surface by its vertex numbers, as it is: nothing is welded. Triangles with a repeated corner
/// count in `triangles` only. Positions must be finite and corners exist. Linear time but for small sorts.
SurfaceMeasures surface_measures(const TriangleMesh& mesh);

/// What `kerf info` says about a mesh file.
struct MeshInfo {
  SurfaceMeasures measures;
  bool has_texture = false;
  std::size_t groups = 0;    ///< different group numbers; 1 when the mesh has none
  double shortest_edge = 0;  ///< metres
  double mean_edge = 0;
  double longest_edge = 0;
  double smallest_area = 0;  ///< m^2
  double largest_area = 0;
};
MeshInfo mesh_info(const TriangleMesh& mesh);

}  // namespace kerf
