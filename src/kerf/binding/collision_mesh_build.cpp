#include "kerf/binding/collision_mesh_build.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kerf/base/indexed.h"
#include "kerf/mesh/half_edge_build.h"

namespace kerf {

std::vector<Vec3> vertex_normals(const TriangleMesh& mesh) {
  std::vector<Vec3> normals(mesh.positions.size());
  for (const auto& t : mesh.triangles) {
    const Vec3 p[3] = {mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]};
    const Vec3 n = normalized(cross(p[1] - p[0], p[2] - p[0]));
    for (int i = 0; i < 3; ++i) {
      const Vec3 a = normalized(p[(i + 1) % 3] - p[i]), b = normalized(p[(i + 2) % 3] - p[i]);
      const double angle = std::acos(std::clamp(dot(a, b), -1.0, 1.0));
      normals[t[static_cast<std::size_t>(i)].index()] += angle * n;
    }
  }
  for (Vec3& n : normals) n = normalized(n);
  return normals;
}

Result<CollisionMesh> build_collision_mesh(const TriangleMesh& surface, std::span<const double> half_thickness) {
  KERF_ASSERT(half_thickness.size() == surface.positions.size());
  std::vector<std::array<std::int32_t, 3>> triangles;
  triangles.reserve(surface.triangles.size());
  for (const auto& t : surface.triangles) triangles.push_back({t[0].value, t[1].value, t[2].value});
  auto connected = build_half_edges(triangles, surface.positions.size());
  if (!connected) return Error{connected.error().kind, "collision mesh: " + connected.error().message};

  using H = CollisionHalfEdge;
  std::vector<CollisionVertex> origin;
  std::vector<H> twin, outgoing;
  std::vector<Vec2> planar;
  std::vector<RootId> root;
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    const auto& t = surface.triangles[TriangleId(f)];
    const Vec3 a = surface.positions[t[0]], b = surface.positions[t[1]], c = surface.positions[t[2]];
    const Vec3 x = normalized(b - a), normal = cross(b - a, c - a);
    if (!(norm(normal) > 1e-12 * norm(b - a) * norm(c - a)))
      return bad_input(
          fmt::format("collision mesh: triangle {} has no area; remove it or move its vertices apart", f + 1));
    const Vec3 y = cross(normalized(normal), x);
    planar.push_back({0, 0});
    planar.push_back({norm(b - a), 0});
    planar.push_back({dot(c - a, x), dot(c - a, y)});
    for (const std::int32_t v : triangles[f]) origin.push_back(CollisionVertex(v));
    root.push_back(RootId(f));
  }
  for (const std::int32_t h : connected->twin) twin.push_back(H(h));
  for (std::size_t v = 0; v < surface.positions.size(); ++v) {
    if (connected->outgoing[v] < 0)
      return bad_input(fmt::format("collision mesh: vertex {} belongs to no triangle; remove it", v + 1));
    outgoing.push_back(H(connected->outgoing[v]));
  }

  const std::vector<Vec3> normals = vertex_normals(surface);
  std::vector<Vec3> offset;
  std::vector<CollisionVertex> ancestor;
  for (std::size_t v = 0; v < normals.size(); ++v) {
    offset.push_back(half_thickness[v] * normals[v]);
    ancestor.push_back(CollisionVertex(v));
  }

  CollisionMesh mesh;
  const std::size_t nh = origin.size(), nv = normals.size(), nf = root.size();
  mesh.origin = Journaled<H, CollisionVertex>(std::move(origin));
  mesh.twin = Journaled<H, H>(std::move(twin));
  mesh.planar = Journaled<H, Vec2>(std::move(planar));
  mesh.outgoing = Journaled<CollisionVertex, H>(std::move(outgoing));
  mesh.chain.grow(nh);
  mesh.wall.grow(nh);
  mesh.rest = Journaled<CollisionVertex, Vec3>(surface.positions.raw());
  mesh.offset = Journaled<CollisionVertex, Vec3>(std::move(offset));
  mesh.bound.grow(nv);
  mesh.line.grow(nv);
  mesh.ancestor = Journaled<CollisionVertex, CollisionVertex>(std::move(ancestor));
  mesh.root = Journaled<CollisionTriangle, RootId>(std::move(root));
  mesh.free.grow(nf);
  return mesh;
}

double mean_edge(const CollisionMesh& c) {
  double sum = 0;
  for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(c.half_edge_count()))
    sum += norm(c.rest[c.to(h)] - c.rest[c.from(h)]);
  return sum / static_cast<double>(c.half_edge_count());
}

}  // namespace kerf
