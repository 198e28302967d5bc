#include "kerf/midsurface/surface_mesh.h"

#include <algorithm>
#include <cmath>

#include "kerf/mesh/half_edge_build.h"
#include "kerf/mesh/union_find.h"

namespace kerf::mid {

Result<SurfaceMesh> connect(Column<Vec3> positions, const std::vector<std::array<std::int32_t, 3>>& triangles) {
  auto arrays = build_half_edges(triangles, positions.size());
  if (!arrays) return arrays.error();
  SurfaceMesh mesh;
  mesh.position = std::move(positions);
  mesh.origin.reserve(3 * triangles.size());
  for (const auto& t : triangles) mesh.origin.insert(mesh.origin.end(), t.begin(), t.end());
  mesh.twin = Column<std::int32_t>(std::move(arrays->twin));
  mesh.outgoing = Column<std::int32_t>(std::move(arrays->outgoing));
  return mesh;
}

Result<SurfaceMesh> connect(const TriangleMesh& mesh) {
  std::vector<std::array<std::int32_t, 3>> triangles;
  triangles.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) triangles.push_back({t[0].value, t[1].value, t[2].value});
  return connect(Column<Vec3>(mesh.positions.raw()), triangles);
}

SurfaceMesh compacted(const SurfaceMesh& mesh, std::vector<std::int32_t>* vertex_of) {
  SurfaceMesh out;
  Column<std::int32_t> vertex(mesh.position.size(), -1), face(static_cast<std::size_t>(mesh.face_count()), -1);
  if (vertex_of != nullptr) vertex_of->clear();
  for (std::int32_t v = 0; v < mesh.vertex_count(); ++v) {
    if (!mesh.has_vertex(v)) continue;
    vertex[v] = out.position.count();
    out.position.push_back(mesh.position[v]);
    if (vertex_of != nullptr) vertex_of->push_back(v);
  }
  std::int32_t faces = 0;
  for (std::int32_t f = 0; f < mesh.face_count(); ++f)
    if (mesh.has_face(f)) face[f] = faces++;
  const auto half_edge = [&](std::int32_t h) { return h < 0 ? -1 : 3 * face[h / 3] + h % 3; };
  out.origin.reserve(3 * static_cast<std::size_t>(faces));
  out.twin.reserve(3 * static_cast<std::size_t>(faces));
  for (std::int32_t h = 0; h < mesh.origin.count(); ++h) {
    if (mesh.origin[h] < 0) continue;
    out.origin.push_back(vertex[mesh.origin[h]]);
    out.twin.push_back(half_edge(mesh.twin[h]));
  }
  for (std::int32_t v = 0; v < mesh.vertex_count(); ++v)
    if (mesh.has_vertex(v)) out.outgoing.push_back(half_edge(mesh.outgoing[v]));
  return out;
}

TriangleMesh to_triangle_mesh(const SurfaceMesh& mesh, std::vector<std::int32_t>* vertex_of) {
  const SurfaceMesh dense = compacted(mesh, vertex_of);
  TriangleMesh out;
  out.positions = IndexedArray<VertexId, Vec3>(std::vector<Vec3>(dense.position));
  for (std::int32_t f = 0; f < dense.face_count(); ++f)
    out.triangles.push_back(
        {VertexId(dense.origin[3 * f]), VertexId(dense.origin[3 * f + 1]), VertexId(dense.origin[3 * f + 2])});
  return out;
}

std::vector<std::vector<std::int32_t>> border_loops(const SurfaceMesh& mesh) {
  std::vector<std::vector<std::int32_t>> loops;
  Column<std::uint8_t> done(mesh.origin.size(), 0);
  for (std::int32_t start = 0; start < mesh.origin.count(); ++start) {
    if (mesh.origin[start] < 0 || mesh.twin[start] >= 0 || done[start]) continue;
    std::vector<std::int32_t>& loop = loops.emplace_back();
    for (std::int32_t h = start; !done[h]; h = mesh.outgoing[mesh.to(h)]) {
      done[h] = 1;
      loop.push_back(mesh.from(h));
    }
  }
  return loops;
}

Topology topology(const SurfaceMesh& mesh) {
  Topology out;
  UnionFind sets(mesh.position.size());
  std::int64_t vertices = 0, edges = 0, faces = 0;
  for (std::int32_t h = 0; h < mesh.origin.count(); ++h) {
    if (!mesh.is_edge(h)) continue;
    ++edges;
    sets.join(mesh.from(h), mesh.to(h));
  }
  for (std::int32_t f = 0; f < mesh.face_count(); ++f) faces += mesh.has_face(f);
  for (std::int32_t v = 0; v < mesh.vertex_count(); ++v) {
    if (!mesh.has_vertex(v)) continue;
    ++vertices;
    out.components += sets.is_root(static_cast<std::size_t>(v));
  }
  out.euler = vertices - edges + faces;
  out.loops = static_cast<std::int32_t>(border_loops(mesh).size());
  return out;
}

double mean_edge(const SurfaceMesh& m) {
  double sum = 0;
  std::size_t n = 0;
  for (std::int32_t h = 0; h < m.origin.count(); ++h)
    if (m.is_edge(h)) {
      sum += m.length(h);
      ++n;
    }
  return n > 0 ? sum / static_cast<double>(n) : 0;
}

double total_area(const SurfaceMesh& mesh) {
  double sum = 0;
  for (std::int32_t f = 0; f < mesh.face_count(); ++f)
    if (mesh.has_face(f)) sum += mesh.area(f);
  return sum;
}

double enclosed_volume(const SurfaceMesh& mesh) {
  double sum = 0;
  const Vec3 o = mesh.position.empty() ? Vec3{} : mesh.position[0];
  for (std::int32_t f = 0; f < mesh.face_count(); ++f) {
    if (!mesh.has_face(f)) continue;
    const auto [a, b, c] = mesh.corners(f);
    sum += dot(a - o, cross(b - o, c - o)) / 6;
  }
  return sum;
}

Vec3 vertex_normal(const SurfaceMesh& mesh, std::int32_t v) {
  Vec3 sum;
  const Vec3 p = mesh.position[v];
  mesh.for_each_outgoing(v, [&](std::int32_t h) {
    const Vec3 a = mesh.position[mesh.to(h)] - p, b = mesh.position[mesh.apex(h)] - p, n = cross(a, b);
    sum += std::atan2(norm(n), dot(a, b)) * normalized(n);
  });
  return normalized(sum);
}

Column<Vec3> vertex_normals(const SurfaceMesh& mesh) {
  Column<Vec3> out(mesh.position.size());
  for (std::int32_t v = 0; v < mesh.vertex_count(); ++v)
    if (mesh.has_vertex(v)) out[v] = vertex_normal(mesh, v);
  return out;
}

}  // namespace kerf::mid
