#include "kerf/session/render_surface.h"

#include <array>
#include <utility>

#include "kerf/base/prefetch.h"
#include "kerf/cutting/half_edge_split.h"

namespace kerf {
namespace {

/// Walls that meet at less than this angle (its cosine) are shaded as one smooth cut.
constexpr double kSmoothWall = 0.64;

Vec3 face_vector(const VisualMesh& mesh, VisualTriangle f) {
  const VisualHalfEdge h = VisualMesh::corner(f, 0);
  const Vec3 a = mesh.rest[mesh.from(h)], b = mesh.rest[mesh.to(h)], c = mesh.rest[mesh.apex(h)];
  return cross(b - a, c - a);
}

struct WallCorner {
  RenderVertex found;    ///< v's render vertex on this wall
  RenderVertex sibling;  ///< and one on another wall
};
WallCorner find_on_walls(const VisualMesh& mesh, const RenderSurface& surface, VisualVertex v, Patch patch) {
  WallCorner out;
  cut::for_each_corner(mesh, v, [&](VisualHalfEdge h) {  // a body with walls is closed: the fan is whole
    const Patch other = mesh.patch[VisualMesh::face(h)];
    if (!other.is_wall()) return true;
    const RenderVertex r = surface.corner[h];
    if (!r.valid() || surface.vertex[r] != v) return true;  // not up to date yet
    if (surface.patch[r] == patch) out.found = r;
    else if (surface.patch[r] == other) out.sibling = r;
    return !out.found.valid();
  });
  return out;
}

/// Render vertices of walls found last: corners of a vertex come soon after one another.
class FoundOnWalls {
 public:
  [[nodiscard]] RenderVertex find(VisualVertex v, Patch patch) const {
    const Entry& e = entry_[v.index() % kSize];
    return e.vertex == v && e.patch == patch ? e.found : RenderVertex{};
  }
  void note(VisualVertex v, Patch patch, RenderVertex found) { entry_[v.index() % kSize] = {v, patch, found}; }

 private:
  static constexpr std::size_t kSize = 128;
  struct Entry {
    VisualVertex vertex;
    Patch patch;
    RenderVertex found;
  };
  std::array<Entry, kSize> entry_{};
};

}  // namespace

void update_render_surface(const VisualMesh& mesh, std::span<const VisualTriangle> changed, RenderSurface& surface) {
  // One by one: g++ 12 fills a grown array of ids through memory, at a dozen cycles each.
  while (surface.skin.size() < mesh.vertex_count()) surface.skin.push_back({});
  while (surface.corner.size() < mesh.half_edge_count()) surface.corner.push_back({});
  const std::size_t first_new = surface.size();
  std::vector<Vec3> sum;                                        // of the faces around each new wall vertex
  std::vector<std::pair<RenderVertex, RenderVertex>> siblings;  // on two walls that meet in a line
  FoundOnWalls found;
  const auto add_vertex = [&](VisualVertex v, Patch patch, Vec3f normal) {
    surface.patch.push_back(patch);
    surface.normal.push_back(normal);
    sum.emplace_back();
    return surface.vertex.push_back(v);
  };
  for (std::size_t i = 0; i < changed.size(); ++i) {
    if (i + 2 * kPrefetchAhead < changed.size()) {
      const VisualHalfEdge h = VisualMesh::corner(changed[i + 2 * kPrefetchAhead], 0);
      prefetch(mesh.origin, h);
      prefetch(surface.corner, h);
      prefetch(mesh.patch, VisualMesh::face(h));
    }
    if (i + kPrefetchAhead < changed.size())
      for (int k = 0; k < 3; ++k) prefetch(surface.skin, mesh.from(VisualMesh::corner(changed[i + kPrefetchAhead], k)));
    const VisualTriangle f = changed[i];
    const Patch patch = mesh.patch[f];
    const Vec3 face = patch.is_wall() ? face_vector(mesh, f) : Vec3{};
    for (int k = 0; k < 3; ++k) {
      const VisualHalfEdge h = VisualMesh::corner(f, k);
      const VisualVertex v = mesh.from(h);
      RenderVertex r;
      if (!patch.is_wall()) {
        r = surface.skin[v];
        if (!r.valid()) {
          r = add_vertex(v, patch, mesh.normal[v]);
          surface.skin.set(v, r);
        }
      } else {
        r = found.find(v, patch);
        if (!r.valid()) {
          const WallCorner around = find_on_walls(mesh, surface, v, patch);
          r = around.found;
          if (!r.valid()) {
            r = add_vertex(v, patch, {});
            if (around.sibling.valid()) siblings.emplace_back(r, around.sibling);
          }
          found.note(v, patch, r);
        }
        if (r.index() >= first_new) sum[r.index() - first_new] += face;
      }
      if (surface.corner[h] != r) surface.corner.set(h, r);
    }
  }
  for (std::size_t i = 0; i < sum.size(); ++i) {
    const RenderVertex r(first_new + i);
    if (surface.patch[r].is_wall()) surface.normal.set(r, to_float(normalized(sum[i])));
  }
  // Walls that go on smoothly are shaded as one.
  for (const auto& [a, b] : siblings) {
    const Vec3 na = to_double(surface.normal[a]), nb = to_double(surface.normal[b]);
    if (dot(na, nb) < kSmoothWall) continue;
    const Vec3f both = to_float(normalized(na + nb));
    surface.normal.set(a, both);
    surface.normal.set(b, both);
  }
}

void evaluate_render_surface(const RenderSurface& surface, const VisualMesh& mesh, const HexMesh& hex,
                             const Embedding& embedding, std::span<const Vec3> node_positions,
                             std::vector<Vec3f>& positions, std::vector<Vec3f>& normals) {
  positions.resize(surface.size());
  normals.resize(surface.size());
  for (std::size_t i = 0; i < surface.size(); ++i) {
    const VisualVertex v = surface.vertex[RenderVertex(i)];
    const HexId copy = embedding.visual[v];
    const LatticeFrame& frame = hex.frame_of(copy);
    const Vec3 half{2 / frame.cell.x, 2 / frame.cell.y, 2 / frame.cell.z};
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
    const Vec3 n = transposed_times(frame.axes, to_double(surface.normal[RenderVertex(i)]));
    normals[i] = to_float(normalized(n.x * cross(gy, gz) + n.y * cross(gz, gx) + n.z * cross(gx, gy)));
  }
}

}  // namespace kerf
