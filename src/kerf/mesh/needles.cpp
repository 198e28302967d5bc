#include "kerf/mesh/needles.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "kerf/mesh/surface_tolerances.h"

namespace kerf {

std::vector<VertexId> find_needles(const TriangleMesh& mesh, std::span<const std::int32_t> place) {
  const auto at = [&](VertexId v) { return static_cast<std::size_t>(place[v.index()]); };
  const double steepest = std::tan(kNeedle);
  std::vector<double> angle(mesh.positions.size(), 0);
  std::vector<std::uint8_t> blunt(angle.size(), 0);
  const auto each_corner = [&](auto&& look) {
    for (const auto& t : mesh.triangles) {
      const std::array<std::size_t, 3> v{at(t[0]), at(t[1]), at(t[2])};
      if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) continue;
      for (std::size_t i = 0; i < 3; ++i) look(v[i], v[(i + 1) % 3], v[(i + 2) % 3]);
    }
  };
  each_corner([&](std::size_t v, std::size_t a, std::size_t b) {
    if (blunt[v]) return;
    const Vec3 p = mesh.positions.raw()[v], u = mesh.positions.raw()[a] - p, w = mesh.positions.raw()[b] - p;
    const double across = norm(cross(u, w)), along = dot(u, w);
    if (!(across < steepest * along)) blunt[v] = 1;
    else angle[v] += across / along;  // its tangent is no smaller
  });
  // Where each edge has two triangles, each neighbour is met twice, and there are three at least.
  std::vector<std::pair<std::size_t, std::size_t>> around;
  each_corner([&](std::size_t v, std::size_t a, std::size_t b) {
    if (blunt[v] || !(angle[v] < kNeedle)) return;
    around.emplace_back(v, a);
    around.emplace_back(v, b);
  });
  std::sort(around.begin(), around.end());
  std::vector<VertexId> found;
  for (std::size_t i = 0; i < around.size();) {
    const std::size_t v = around[i].first;
    bool closed = true;
    std::size_t neighbours = 0;
    while (i < around.size() && around[i].first == v) {
      std::size_t end = i;
      while (end < around.size() && around[end] == around[i]) ++end;
      closed = closed && end - i == 2;
      ++neighbours;
      i = end;
    }
    if (closed && neighbours > 2) found.push_back(VertexId(v));
  }
  return found;
}

}  // namespace kerf
