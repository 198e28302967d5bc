#include "kerf/session/render_surface.h"

#include <algorithm>

namespace kerf {
namespace {

/// Walls that meet at less than this angle (its cosine) are shaded as one smooth cut.
constexpr double kSmoothWall = 0.64;

Vec3 face_vector(const VisualMesh& mesh, VisualTriangle f) {
  const VisualHalfEdge h = VisualMesh::corner(f, 0);
  const Vec3 a = mesh.rest[mesh.from(h)], b = mesh.rest[mesh.to(h)], c = mesh.rest[mesh.apex(h)];
  return cross(b - a, c - a);
}

/// Area-weighted normal of the wall `patch` at a vertex, neighbouring walls that go on smoothly included.
Vec3f wall_normal(const VisualMesh& mesh, VisualVertex v, Patch patch) {
  Vec3 own, all;
  mesh.for_each_outgoing(v, [&](VisualHalfEdge h) {
    const VisualTriangle f = VisualMesh::face(h);
    if (mesh.patch[f] == patch) own += face_vector(mesh, f);
    return true;
  });
  const Vec3 direction = normalized(own);
  mesh.for_each_outgoing(v, [&](VisualHalfEdge h) {
    const VisualTriangle f = VisualMesh::face(h);
    if (!mesh.patch[f].is_wall()) return true;
    const Vec3 n = face_vector(mesh, f);
    if (dot(n, direction) > kSmoothWall * norm(n)) all += n;
    return true;
  });
  const Vec3 n = normalized(all);
  return to_float(norm(n) > 0 ? n : direction);
}

RenderVertex find_on_wall(const VisualMesh& mesh, const RenderSurface& surface, VisualVertex v, Patch patch) {
  RenderVertex found;
  mesh.for_each_outgoing(v, [&](VisualHalfEdge h) {
    if (h.index() >= surface.corner.size() || mesh.patch[VisualMesh::face(h)] != patch) return true;
    const RenderVertex r = surface.corner[h];
    if (r.valid() && surface.vertex[r] == v && surface.patch[r] == patch) found = r;
    return !found.valid();
  });
  return found;
}

}  // namespace

void update_render_surface(const VisualMesh& mesh, std::span<const VisualTriangle> changed, RenderSurface& surface) {
  if (surface.skin.size() < mesh.vertex_count()) surface.skin.grow(mesh.vertex_count() - surface.skin.size());
  if (surface.corner.size() < mesh.half_edge_count())
    surface.corner.grow(mesh.half_edge_count() - surface.corner.size());
  for (const VisualTriangle f : changed) {
    const Patch patch = mesh.patch[f];
    for (int i = 0; i < 3; ++i) {
      const VisualHalfEdge h = VisualMesh::corner(f, i);
      const VisualVertex v = mesh.from(h);
      RenderVertex r;
      if (!patch.is_wall()) {
        r = surface.skin[v];
        if (!r.valid()) {
          r = surface.vertex.push_back(v);
          surface.patch.push_back(patch);
          surface.normal.push_back(mesh.normal[v]);
          surface.skin.set(v, r);
        }
      } else {
        r = find_on_wall(mesh, surface, v, patch);
        if (!r.valid()) {
          r = surface.vertex.push_back(v);
          surface.patch.push_back(patch);
          surface.normal.push_back(wall_normal(mesh, v, patch));
        }
      }
      if (surface.corner[h] != r) surface.corner.set(h, r);
    }
  }
}

void evaluate_render_surface(const RenderSurface& surface, const VisualMesh& mesh, const HexMesh& hex,
                             const Embedding& embedding, std::span<const Vec3> node_positions,
                             std::vector<Vec3f>& positions, std::vector<Vec3f>& normals) {
  positions.resize(surface.size());
  normals.resize(surface.size());
  const Vec3 half{2 / hex.frame.cell.x, 2 / hex.frame.cell.y, 2 / hex.frame.cell.z};
  for (std::size_t i = 0; i < surface.size(); ++i) {
    const VisualVertex v = surface.vertex[RenderVertex(i)];
    const HexId copy = embedding.visual[v];
    const Vec3 q = hex.local(copy, mesh.rest[v]);
    Vec3 p, gx, gy, gz;
    for (int c = 0; c < 8; ++c) {
      const double sx = (c & 1) ? 1 : -1, sy = (c >> 1 & 1) ? 1 : -1, sz = (c >> 2 & 1) ? 1 : -1;
      const double wx = 0.5 * (1 + sx * q.x), wy = 0.5 * (1 + sy * q.y), wz = 0.5 * (1 + sz * q.z);
      const Vec3 n = node_positions[hex.nodes[copy][static_cast<std::size_t>(c)].index()];
      p += (wx * wy * wz) * n;
      gx += (0.5 * sx * wy * wz * half.x) * n;
      gy += (0.5 * sy * wx * wz * half.y) * n;
      gz += (0.5 * sz * wx * wy * half.z) * n;
    }
    positions[i] = to_float(p);
    // The rest normal in lattice axes, then the cofactor of the gradient taken along them.
    const Vec3 n = transposed_times(hex.frame.axes, to_double(surface.normal[RenderVertex(i)]));
    normals[i] = to_float(normalized(n.x * cross(gy, gz) + n.y * cross(gz, gx) + n.z * cross(gx, gy)));
  }
}

}  // namespace kerf
