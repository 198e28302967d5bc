#include "kerf/mesh/surface_edges.h"

#include <fmt/format.h>

#include <algorithm>

#include "kerf/mesh/surface_tolerances.h"

namespace kerf {

std::vector<EdgeUse> edge_uses(std::span<const std::array<VertexId, 3>> triangles, std::size_t vertex_count) {
  // Counting sort by the lower end, then small sorts.
  std::vector<std::size_t> start(vertex_count + 1, 0);
  const auto ends = [&](std::size_t t, std::size_t i) {
    const std::int32_t a = triangles[t][i].value;
    const std::int32_t b = triangles[t][(i + 1) % 3].value;
    return std::pair(std::min(a, b), std::max(a, b));
  };
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t i = 0; i < 3; ++i) ++start[static_cast<std::size_t>(ends(t, i).first) + 1];
  }
  for (std::size_t v = 0; v < vertex_count; ++v) start[v + 1] += start[v];
  std::vector<EdgeUse> uses(3 * triangles.size());
  std::vector<std::size_t> next(start.begin(), start.end() - 1);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t i = 0; i < 3; ++i) {
      const auto [low, high] = ends(t, i);
      uses[next[static_cast<std::size_t>(low)]++] = {low, high, static_cast<std::int32_t>(3 * t + i)};
    }
  }
  for (std::size_t v = 0; v < vertex_count; ++v) {
    std::sort(uses.begin() + static_cast<std::ptrdiff_t>(start[v]),
              uses.begin() + static_cast<std::ptrdiff_t>(start[v + 1]), [](const EdgeUse& a, const EdgeUse& b) {
                return a.high != b.high ? a.high < b.high : a.half_edge < b.half_edge;
              });
  }
  return uses;
}

LargestFan largest_fan(std::span<const std::array<VertexId, 3>> triangles, std::size_t vertex_count) {
  std::vector<std::size_t> around(vertex_count, 0);
  for (const auto& t : triangles)
    for (const VertexId v : t) ++around[v.index()];
  const auto most = std::max_element(around.begin(), around.end());
  if (most == around.end()) return {};
  return {VertexId(static_cast<std::size_t>(most - around.begin())), *most};
}

std::string large_fan_text(const std::string& vertex, std::size_t triangles) {
  return fmt::format(
      "{} has {} triangles around it, {} are the most that can be bound; divide the polygon there, or re-mesh the "
      "surface evenly",
      vertex, triangles, kMostAround);
}

}  // namespace kerf
