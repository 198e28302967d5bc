// Twins and fans of a triangle list, with the checks that make it an oriented manifold.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "kerf/base/result.h"

namespace kerf {

/// So many elements are going to be added to what is built: memory for them at once is cheaper than moving everything later.
struct HalfEdgeRoom {
  std::size_t triangles = 0, vertices = 0;
};

struct HalfEdgeArrays {
  std::vector<std::int32_t> twin;      ///< 3 |F|, -1 on a border
  std::vector<std::int32_t> outgoing;  ///< |V|, one half-edge of every vertex's fan; -1 for an unused vertex
};

/// Connects triangles (|F| x 3 vertex indices below vertex_count) by their edges, in linear time.
/// Refuses, naming the first offending vertices (1-based, as in files): repeated corner in a triangle, the same
/// directed edge twice (non-manifold, duplicate or inconsistently oriented faces), a vertex with several fans.
Result<HalfEdgeArrays> build_half_edges(std::span<const std::array<std::int32_t, 3>> triangles,
                                        std::size_t vertex_count, HalfEdgeRoom room = {});

}  // namespace kerf
