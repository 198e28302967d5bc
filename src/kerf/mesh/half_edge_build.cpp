#include "kerf/mesh/half_edge_build.h"

#include <fmt/format.h>

namespace kerf {

Result<HalfEdgeArrays> build_half_edges(std::span<const std::array<std::int32_t, 3>> triangles,
                                        std::size_t vertex_count, HalfEdgeRoom room) {
  const auto half_edges = static_cast<std::int32_t>(3 * triangles.size());
  auto origin = [&](std::int32_t h) {
    return triangles[static_cast<std::size_t>(h / 3)][static_cast<std::size_t>(h % 3)];
  };
  auto next = [](std::int32_t h) { return h % 3 == 2 ? h - 2 : h + 1; };
  auto prev = [](std::int32_t h) { return h % 3 == 0 ? h + 2 : h - 1; };

  // Half-edges grouped by origin: first[v] .. first[v+1].
  std::vector<std::int32_t> first(vertex_count + 1, 0);
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    const auto& t = triangles[f];
    for (const std::int32_t v : t)
      if (v < 0 || static_cast<std::size_t>(v) >= vertex_count)
        return bad_input(
            fmt::format("triangle {} refers to vertex {}, but there are {} vertices", f + 1, v + 1, vertex_count));
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0])
      return bad_input(
          fmt::format("triangle {} uses a vertex twice ({} {} {}); remove it", f + 1, t[0] + 1, t[1] + 1, t[2] + 1));
    for (const std::int32_t v : t) ++first[static_cast<std::size_t>(v) + 1];
  }
  for (std::size_t v = 0; v < vertex_count; ++v) first[v + 1] += first[v];
  std::vector<std::int32_t> grouped(static_cast<std::size_t>(half_edges));
  {
    std::vector<std::int32_t> cursor(first.begin(), first.end() - 1);
    for (std::int32_t h = 0; h < half_edges; ++h)
      grouped[static_cast<std::size_t>(cursor[static_cast<std::size_t>(origin(h))]++)] = h;
  }

  HalfEdgeArrays result;
  result.twin.reserve(static_cast<std::size_t>(half_edges) + 3 * room.triangles);
  result.outgoing.reserve(vertex_count + room.vertices);
  result.twin.assign(static_cast<std::size_t>(half_edges), -1);
  result.outgoing.assign(vertex_count, -1);
  // What leaves vertex v, by its target: good while leaving_to[target] is v. What comes in is the half-edge before each that leaves.
  std::vector<std::int32_t> leaving(vertex_count, -1), leaving_to(vertex_count, -1);
  for (std::size_t v = 0; v < vertex_count; ++v) {
    const auto a = static_cast<std::int32_t>(v);
    for (std::int32_t i = first[v]; i < first[v + 1]; ++i) {
      const std::int32_t h = grouped[static_cast<std::size_t>(i)], b = origin(next(h));
      if (leaving_to[static_cast<std::size_t>(b)] == a)
        return bad_input(
            fmt::format("edge {}-{} is used by several triangles in the same direction: the surface is not "
                        "manifold there, has duplicate triangles, or is not oriented consistently",
                        a + 1, b + 1));
      leaving_to[static_cast<std::size_t>(b)] = a;
      leaving[static_cast<std::size_t>(b)] = h;
    }
    for (std::int32_t i = first[v]; i < first[v + 1]; ++i) {
      const std::int32_t g = prev(grouped[static_cast<std::size_t>(i)]), b = origin(g);
      if (leaving_to[static_cast<std::size_t>(b)] == a)
        result.twin[static_cast<std::size_t>(g)] = leaving[static_cast<std::size_t>(b)];
    }
  }

  // One fan per vertex: a turn around the vertex must meet all its half-edges.
  for (std::size_t v = 0; v < vertex_count; ++v) {
    const std::int32_t degree = first[v + 1] - first[v];
    if (degree == 0) continue;
    std::int32_t start = grouped[static_cast<std::size_t>(first[v])];
    for (std::int32_t i = first[v]; i < first[v + 1]; ++i)
      if (result.twin[static_cast<std::size_t>(grouped[static_cast<std::size_t>(i)])] < 0)
        start = grouped[static_cast<std::size_t>(i)];
    std::int32_t count = 0;
    for (std::int32_t h = start;;) {
      ++count;
      h = result.twin[static_cast<std::size_t>(prev(h))];
      if (h < 0 || h == start) break;
    }
    if (count != degree)
      return bad_input(fmt::format(
          "vertex {} joins parts of the surface that touch only there; give each part a vertex of its own", v + 1));
    result.outgoing[v] = start;
  }
  return result;
}

}  // namespace kerf
