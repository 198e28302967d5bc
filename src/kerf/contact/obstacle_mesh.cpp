#include "kerf/contact/obstacle_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kerf/mesh/surface_edges.h"

namespace kerf {
namespace {

Vec3 unit_or(Vec3 v, Vec3 otherwise) {
  const double n = norm(v);
  return n > 1e-300 && std::isfinite(n) ? (1 / n) * v : otherwise;
}

Status check(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) return bad_input("obstacle mesh: there are no triangles");
  for (const VertexId v : ids<VertexId>(mesh.positions.size()))
    if (!is_finite(mesh.positions[v]))
      return bad_input(fmt::format("obstacle mesh: vertex {} has a position that is not finite", v.value + 1));
  for (const TriangleId t : ids<TriangleId>(mesh.triangles.size())) {
    const auto& c = mesh.triangles[t];
    for (const VertexId v : c)
      if (!v.valid() || v.index() >= mesh.positions.size())
        return bad_input(fmt::format("obstacle mesh: triangle {} has vertex {}, but there are {}", t.value + 1,
                                     v.value + 1, mesh.positions.size()));
    if (c[0] == c[1] || c[1] == c[2] || c[2] == c[0])
      return bad_input(fmt::format("obstacle mesh: triangle {} has a vertex twice; remove the triangle", t.value + 1));
  }
  return {};
}

void add_normals(const TriangleMesh& mesh, ObstacleMesh& m) {
  m.vertex_normal.assign(m.positions.size(), {});
  for (const auto& t : mesh.triangles) {
    const Vec3 p[3] = {mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]};
    const Vec3 n = unit_or(cross(p[1] - p[0], p[2] - p[0]), {});
    m.face_normal.push_back(n);
    for (int i = 0; i < 3; ++i) {
      const Vec3 a = normalized(p[(i + 1) % 3] - p[i]), b = normalized(p[(i + 2) % 3] - p[i]);
      m.vertex_normal[t[static_cast<std::size_t>(i)].index()] += std::acos(std::clamp(dot(a, b), -1.0, 1.0)) * n;
    }
  }
  for (Vec3& n : m.vertex_normal) n = unit_or(n, {});
  for (std::size_t f = 0; f < m.face_normal.size(); ++f) {
    Vec3 around;
    for (std::size_t i = 0; i < 3; ++i) around += m.vertex_normal[static_cast<std::size_t>(m.corners[3 * f + i])];
    m.face_normal[f] = unit_or(m.face_normal[f], unit_or(around, {0, 0, 1}));
  }
  for (std::size_t i = 0; i < m.corners.size(); ++i) {  // thin needles cancel out: any face's normal will do
    Vec3& n = m.vertex_normal[static_cast<std::size_t>(m.corners[i])];
    if (n == Vec3{}) n = m.face_normal[i / 3];
  }
}

void add_edges(const TriangleMesh& mesh, ObstacleMesh& m) {
  const std::size_t n = m.corners.size();
  m.twin.assign(n, -1);
  m.convex_edge.assign(n, 0);
  m.edge_normal.resize(n);
  for (std::size_t h = 0; h < n; ++h) m.edge_normal[h] = m.face_normal[h / 3];
  const std::vector<EdgeUse> uses = edge_uses(mesh.triangles.raw(), m.positions.size());
  m.closed = true;
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    const auto h = static_cast<std::size_t>(edge[0].half_edge);
    const auto from = [&](const EdgeUse& u) { return m.corners[static_cast<std::size_t>(u.half_edge)]; };
    if (edge.size() != 2 || from(edge[0]) == from(edge[1])) {
      m.closed = false;
      m.convex_edge[h] = 1;
      return;
    }
    const auto g = static_cast<std::size_t>(edge[1].half_edge);
    m.twin[h] = edge[1].half_edge;
    m.twin[g] = edge[0].half_edge;
    const Vec3 a = m.face_normal[h / 3], b = m.face_normal[g / 3];
    m.edge_normal[h] = m.edge_normal[g] = unit_or(a + b, a);
    const std::size_t apex = 3 * (g / 3) + (g + 2) % 3;
    const Vec3 across =
        m.positions[static_cast<std::size_t>(m.corners[apex])] - m.positions[static_cast<std::size_t>(from(edge[0]))];
    const bool bent = norm(cross(a, b)) > std::sin(kFlatEdge) || dot(a, b) < 0;
    m.convex_edge[h] = bent && dot(across, a) < 0 ? 1 : 0;
  });
}

void pack_leaves(ObstacleMesh& m) {
  ObstacleLeaves& l = m.leaves;
  l.range.resize(m.tree.nodes().size());
  for (std::size_t n = 0; n < l.range.size(); ++n) {
    ObstacleLeaves::Range& r = l.range[n];
    r.triangle = static_cast<std::uint32_t>(l.triangles.size());
    r.edge = static_cast<std::uint32_t>(l.edges.size());
    r.vertex = static_cast<std::uint32_t>(l.vertices.size());
    const TriangleBvh::Node node = m.tree.nodes()[n];
    l.box.push_back({{{node.min[0], node.min[1], node.min[2]}}, {{node.max[0], node.max[1], node.max[2]}}});
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const std::int32_t t = m.tree.order()[i];
      const std::array<Vec3, 3> p = m.view()[t];
      l.triangles.push_back({box_of(p), p, t});
      for (std::int32_t h = 3 * t; h < 3 * t + 3; ++h) {
        const auto k = static_cast<std::size_t>(h), side = k % 3;
        if (m.vertex_owner[static_cast<std::size_t>(m.corners[k])] == h) l.vertices.push_back(m.corners[k]);
        if (m.convex_edge[k] == 0) continue;
        const Vec3 a = p[side], b = p[(side + 1) % 3];
        ObstacleLeaves::Edge edge{box_of(std::array{a, b}),
                                  a,
                                  b,
                                  {normalized(cross(m.face_normal[k / 3], b - a)), {}},
                                  h,
                                  static_cast<float>(1.000001 * norm(b - a))};
        if (m.twin[k] >= 0)
          edge.into[1] = normalized(cross(b - a, m.face_normal[static_cast<std::size_t>(m.twin[k]) / 3]));
        l.edges.push_back(edge);
      }
    }
    r.triangle_end = static_cast<std::uint32_t>(l.triangles.size());
    r.edge_end = static_cast<std::uint32_t>(l.edges.size());
    r.vertex_end = static_cast<std::uint32_t>(l.vertices.size());
  }
}

}  // namespace

Result<ObstacleMesh> make_obstacle_mesh(const TriangleMesh& mesh) {
  KERF_TRY(check(mesh));
  ObstacleMesh m;
  m.positions = mesh.positions.raw();
  m.corners.reserve(3 * mesh.triangles.size());
  for (const auto& t : mesh.triangles)
    for (const VertexId v : t) {
      m.corners.push_back(v.value);
      m.box.add(mesh.positions[v]);
    }
  add_normals(mesh, m);
  add_edges(mesh, m);
  m.vertex_owner.assign(m.positions.size(), -1);
  for (std::size_t h = 0; h < m.corners.size(); ++h) {
    if (m.convex_edge[h] == 0) continue;
    const std::size_t next = h % 3 == 2 ? h - 2 : h + 1;
    for (const std::size_t end : {h, next}) {
      std::int32_t& owner = m.vertex_owner[static_cast<std::size_t>(m.corners[end])];
      if (owner < 0) owner = static_cast<std::int32_t>(end);
    }
  }
  m.tree = TriangleBvh(m.view());
  pack_leaves(m);
  return m;
}

}  // namespace kerf
