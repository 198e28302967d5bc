// Everything on the visual mesh that a collision triangle owns, with the triangles that share the ownership.
#pragma once

#include "kerf/binding/cell_complex.h"

namespace kerf {

/// How a visual vertex hangs on the triangle it was found through.
enum class Ownership {
  kFree,    ///< inside the triangle
  kChain,   ///< on an edge: shared with the triangle across, if any
  kCorner,  ///< bound to a corner or on its line: shared with the corner's whole fan
  kWall,    ///< inside the wall of a cut edge
};

/// for_each_owned without free vertices.
template <class Fn>
void for_each_on_edges(const CellComplex& body, CollisionTriangle t, Fn&& f) {
  const CollisionMesh& mesh = body.collision;
  for (int i = 0; i < 3; ++i) {
    const CollisionHalfEdge h = CollisionMesh::corner(t, i);
    for (const PoolRun& run : mesh.chain[h])
      for (std::int32_t k = 0; k < run.count; ++k) f(body.chain_pool[PoolIndex(run.first + k)], Ownership::kChain, h);
    const CollisionVertex v = mesh.origin[h];
    for (const VisualVertex b : mesh.bound[v])
      if (b.valid()) f(b, Ownership::kCorner, h);
    const PoolRun line = mesh.line[v];
    for (std::int32_t k = 0; k < line.count; ++k) f(body.chain_pool[PoolIndex(line.first + k)], Ownership::kCorner, h);
    if (const WallId wall = mesh.wall[h]; wall.valid()) {
      const PoolRun run = body.wall_inner[wall];
      for (std::int32_t k = 0; k < run.count; ++k) f(body.wall_pool[PoolIndex(run.first + k)], Ownership::kWall, h);
    }
  }
}

/// Calls f(vertex, ownership, half-edge) for all visual vertices of triangle t (table in cell_complex.h): free ones of both
/// sides, chains of its edges, bound vertices and lines of its corners, walls of its border edges. The half-edge is the
/// edge, or the corner's outgoing half-edge in t. Shared vertices are reported through every triangle they belong to.
template <class Fn>
void for_each_owned(const CellComplex& body, CollisionTriangle t, Fn&& f) {
  const CollisionMesh& mesh = body.collision;
  const CollisionHalfEdge first = CollisionMesh::corner(t, 0);
  for (const PoolRun& run : mesh.free[t])
    for (std::int32_t i = 0; i < run.count; ++i) {
      const VisualVertex v = body.free_pool[PoolIndex(run.first + i)];
      if (body.visual.free[v] != 0) f(v, Ownership::kFree, first);  // others moved to a chain meanwhile
    }
  for_each_on_edges(body, t, f);
}

}  // namespace kerf
