// Volumes of the drawn pieces of a body, by the divergence theorem, found without the library's functions for pieces and measures.
#pragma once

#include <algorithm>
#include <numeric>
#include <vector>

#include "kerf/binding/cell_complex.h"

namespace kerf::testing_support {

/// Cubic metres at rest, ascending; pieces are joined by shared vertices.
inline std::vector<double> piece_volumes(const CellComplex& body) {
  const VisualMesh& v = body.visual;
  std::vector<std::size_t> parent(v.vertex_count());
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const auto find = [&](std::size_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  const auto corner = [&](std::size_t h) { return v.origin[VisualHalfEdge(h)].index(); };
  for (std::size_t h = 0; h < v.half_edge_count(); h += 3)
    for (std::size_t k = 1; k < 3; ++k) parent[find(corner(h))] = find(corner(h + k));
  std::vector<double> sum(v.vertex_count(), 0.0);
  std::vector<std::uint8_t> used(v.vertex_count(), 0);
  for (std::size_t h = 0; h < v.half_edge_count(); h += 3) {
    const std::size_t piece = find(corner(h));
    const Vec3 o = v.rest[VisualVertex(piece)];
    const auto p = [&](std::size_t k) { return v.rest[VisualVertex(corner(h + k))] - o; };
    sum[piece] += dot(p(0), cross(p(1), p(2))) / 6;
    used[piece] = 1;
  }
  std::vector<double> volumes;
  for (std::size_t i = 0; i < sum.size(); ++i)
    if (used[i]) volumes.push_back(sum[i]);
  std::sort(volumes.begin(), volumes.end());
  return volumes;
}

}  // namespace kerf::testing_support
