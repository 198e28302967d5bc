#include "kerf/geodesic/validate_path.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace kerf {
namespace {

bool all_around(const WalledSurface& m, std::int32_t v, Sector sector, auto&& test) {
  bool found = false;
  for_each_in_sector(m, v, sector, [&](std::int32_t h) { return !(found = test(h)); });
  return found;
}

// Does the step from one stop to the next lie in one face or on a passable edge? Reports the face walked through.
bool joined(const PathQuery& query, const PathStop& a, const PathStop& b, std::int32_t& face) {
  const WalledSurface& m = query.surface;
  const auto sector = [&](std::int32_t v) { return v == query.s ? query.at_s : v == query.t ? query.at_t : Sector{}; };
  face = -1;
  if (a.half_edge >= 0 && b.half_edge >= 0) {
    face = m.opposite(a.half_edge) / 3;
    return face == b.half_edge / 3 && m.opposite(a.half_edge) != b.half_edge;
  }
  if (a.half_edge < 0 && b.half_edge < 0)
    return all_around(m, a.vertex, sector(a.vertex), [&](std::int32_t h) {
      return m.to(h) == b.vertex && query.passable(h) && query.in_sector(b.vertex, sector(b.vertex), m.opposite(h));
    });
  // One edge point: the face between, or along the edge itself.
  const std::int32_t v = a.half_edge < 0 ? a.vertex : b.vertex;
  const std::int32_t h = a.half_edge < 0 ? b.half_edge : m.opposite(a.half_edge);
  if (m.apex(h) == v) {
    face = h / 3;
    return query.in_sector(v, sector(v), WalledSurface::prev(h));
  }
  if (m.from(h) == v) return query.in_sector(v, sector(v), h);
  return m.to(h) == v && query.in_sector(v, sector(v), m.opposite(h));
}

}  // namespace

Status validate_path(const PathQuery& query, const SurfacePath& path) {
  const auto wrong = [&](const char* what, std::size_t stop) {
    return failed(fmt::format("path from vertex {} to vertex {}: {} at stop {} of {}", query.s + 1, query.t + 1, what,
                              stop + 1, path.stops.size()));
  };
  if (path.stops.size() < 2) return wrong("too few stops", 0);
  if (path.stops.front().vertex != query.s) return wrong("does not start in the first vertex", 0);
  if (path.stops.back().vertex != query.t) return wrong("does not end in the last vertex", path.stops.size() - 1);
  if (!(path.length >= 0)) return wrong("no length", 0);
  std::vector<std::int32_t> faces, vertices;
  for (std::size_t i = 0; i < path.stops.size(); ++i) {
    const PathStop& stop = path.stops[i];
    if (stop.half_edge >= 0) {
      if (!query.passable(stop.half_edge)) return wrong("crosses a wall or border", i);
      if (!(stop.t > 0 && stop.t < 1)) return wrong("an edge point not inside its edge", i);
    } else {
      const bool end = i == 0 || i + 1 == path.stops.size();
      if (!end && !query.free(stop.vertex)) return wrong("passes through a wall vertex", i);
      vertices.push_back(stop.vertex);
    }
    if (i == 0) continue;
    std::int32_t face = -1;
    if (!joined(query, path.stops[i - 1], stop, face)) return wrong("a step that leaves the surface", i);
    if (face >= 0) faces.push_back(face);
  }
  for (auto* list : {&faces, &vertices}) {
    std::sort(list->begin(), list->end());
    if (std::adjacent_find(list->begin(), list->end()) != list->end()) return wrong("a loop", 0);
  }
  return {};
}

}  // namespace kerf
