#include "kerf/mesh/surface_measures.h"

#include <algorithm>

#include "kerf/mesh/surface_edges.h"
#include "kerf/mesh/union_find.h"

namespace kerf {
namespace {

Vec3 doubled_area(const TriangleMesh& mesh, const std::array<VertexId, 3>& t) {
  const Vec3 a = mesh.positions[t[0]];
  return cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a);
}

std::vector<std::array<VertexId, 3>> proper_triangles(const TriangleMesh& mesh) {
  std::vector<std::array<VertexId, 3>> out;
  out.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) out.push_back(t);
  }
  return out;
}

}  // namespace

SurfaceMeasures surface_measures(const TriangleMesh& mesh) {
  SurfaceMeasures m;
  m.triangles = mesh.triangles.size();
  std::vector<char> used(mesh.positions.size(), 0);
  for (const auto& t : mesh.triangles) {
    for (const VertexId v : t) used[v.index()] = 1;
  }
  for (std::size_t v = 0; v < used.size(); ++v) {
    if (used[v] == 0) continue;
    ++m.vertices;
    m.box.add(mesh.positions.raw()[v]);
  }
  m.unused_vertices = used.size() - m.vertices;

  const std::vector<std::array<VertexId, 3>> triangles = proper_triangles(mesh);
  const std::vector<EdgeUse> uses = edge_uses(triangles, mesh.positions.size());
  UnionFind parts(triangles.size());
  UnionFind borders(mesh.positions.size());
  std::vector<char> on_border(mesh.positions.size(), 0);
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    ++m.edges;
    for (std::size_t i = 1; i < edge.size(); ++i) parts.join(edge[0].half_edge / 3, edge[i].half_edge / 3);
    if (edge.size() == 1) {
      ++m.border_edges;
      borders.join(edge[0].low, edge[0].high);
      on_border[static_cast<std::size_t>(edge[0].low)] = on_border[static_cast<std::size_t>(edge[0].high)] = 1;
    } else if (edge.size() > 2) {
      ++m.non_manifold_edges;
    } else {
      const auto origin = [&](std::int32_t h) {
        return triangles[static_cast<std::size_t>(h / 3)][static_cast<std::size_t>(h % 3)];
      };
      if (origin(edge[0].half_edge) == origin(edge[1].half_edge)) ++m.unoriented_edges;
    }
  });
  for (std::size_t t = 0; t < triangles.size(); ++t) m.components += parts.is_root(t) ? 1 : 0;
  for (std::size_t v = 0; v < on_border.size(); ++v) m.border_loops += on_border[v] != 0 && borders.is_root(v) ? 1 : 0;
  m.euler = static_cast<std::int64_t>(m.vertices) - static_cast<std::int64_t>(m.edges) +
            static_cast<std::int64_t>(triangles.size());
  m.closed = !triangles.empty() && m.border_edges == 0 && m.non_manifold_edges == 0 && m.unoriented_edges == 0;

  const Vec3 center = m.box.empty() ? Vec3{} : m.box.center();
  for (const auto& t : triangles) {
    const Vec3 n = doubled_area(mesh, t);
    m.area += 0.5 * norm(n);
    m.volume += dot(mesh.positions[t[0]] - center, n) / 6;
  }
  if (!m.closed) m.volume = 0;
  return m;
}

MeshInfo mesh_info(const TriangleMesh& mesh) {
  MeshInfo info;
  info.measures = surface_measures(mesh);
  info.has_texture = mesh.has_texture();
  std::vector<std::int32_t> groups = mesh.group.raw();
  std::sort(groups.begin(), groups.end());
  info.groups =
      groups.empty() ? 1 : static_cast<std::size_t>(std::unique(groups.begin(), groups.end()) - groups.begin());
  const std::vector<std::array<VertexId, 3>> triangles = proper_triangles(mesh);
  const std::vector<EdgeUse> uses = edge_uses(triangles, mesh.positions.size());
  double sum = 0;
  std::size_t count = 0;
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    const double length = norm(mesh.positions[VertexId(edge[0].high)] - mesh.positions[VertexId(edge[0].low)]);
    info.shortest_edge = count == 0 ? length : std::min(info.shortest_edge, length);
    info.longest_edge = std::max(info.longest_edge, length);
    sum += length;
    ++count;
  });
  if (count > 0) info.mean_edge = sum / static_cast<double>(count);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const double area = 0.5 * norm(doubled_area(mesh, mesh.triangles.raw()[t]));
    info.smallest_area = t == 0 ? area : std::min(info.smallest_area, area);
    info.largest_area = std::max(info.largest_area, area);
  }
  return info;
}

}  // namespace kerf
