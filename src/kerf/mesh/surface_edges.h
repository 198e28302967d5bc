// The edges of a triangle list that may be broken in any way: every use of every edge, sorted.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "kerf/base/ids.h"

namespace kerf {

/// Half-edge 3 t + i runs from corner i of triangle t to the next corner; low and high are its ends, sorted.
struct EdgeUse {
  std::int32_t low, high, half_edge;
};

/// All 3 |F| uses, sorted by low, high and half_edge; uses of the same edge are neighbours. Corners must be
/// distinct and below vertex_count. Near linear time.
std::vector<EdgeUse> edge_uses(std::span<const std::array<VertexId, 3>> triangles, std::size_t vertex_count);

/// Calls f(span of the uses of one edge) for every edge, in order.
template <class Fn>
void for_each_edge(std::span<const EdgeUse> uses, Fn&& f) {
  for (std::size_t i = 0; i < uses.size();) {
    std::size_t j = i + 1;
    while (j < uses.size() && uses[j].low == uses[i].low && uses[j].high == uses[i].high) ++j;
    f(uses.subspan(i, j - i));
    i = j;
  }
}

/// The vertex with most triangles; of several the first.
struct LargestFan {
  VertexId vertex;
  std::size_t triangles = 0;
};

/// Corners must be below vertex_count. Linear time.
LargestFan largest_fan(std::span<const std::array<VertexId, 3>> triangles, std::size_t vertex_count);

/// What is said of a fan with more than kMostAround triangles.
std::string large_fan_text(const std::string& vertex, std::size_t triangles);

}  // namespace kerf
