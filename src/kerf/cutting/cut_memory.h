// Memory for cuts to come, touched beforehand: the page faults of first touches cost more than a cut does.
#pragma once

#include <algorithm>

#include "kerf/binding/cell_complex.h"

namespace kerf {

/// Reserves and touches memory in every array of the body for about `visual_vertices` more visual vertices and as many
/// logged writes. 100,000 take about 60 MB.
inline void reserve_cut_memory(CellComplex& body, std::size_t visual_vertices) {
  const std::size_t n = visual_vertices;
  VisualMesh& fine = body.visual;
  fine.origin.reserve_touched(6 * n, 3 * n);
  fine.twin.reserve_touched(6 * n, 3 * n);
  fine.planar.reserve_touched(6 * n, 2 * n);
  fine.outgoing.reserve_touched(n, n);
  fine.texture.reserve_touched(6 * n, 2 * n);
  fine.barrier.reserve_touched(6 * n, n);
  fine.rest.reserve_touched(n, 0);
  fine.normal.reserve_touched(n, 0);
  fine.free.reserve_touched(n, n);
  fine.patch.reserve_touched(2 * n, n);
  const std::size_t m = n / 4;
  CollisionMesh& coarse = body.collision;
  coarse.for_each_array([&](auto& array) { array.reserve_touched(m, m); });
  body.chain_pool.reserve_touched(2 * n, 0);
  body.free_pool.reserve_touched(4 * n, 4 * n);
  body.wall_edge.reserve_touched(m, m);
  body.wall_inner.reserve_touched(m, m);
  body.wall_pool.reserve_touched(n, n);
}

}  // namespace kerf
