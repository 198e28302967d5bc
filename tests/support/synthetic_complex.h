// Valid cell complexes made without the binding, for tests of every module that works on one: the visual mesh is
// the collision mesh subdivided 1-to-4 n times, once (open sheet) or twice at plus and minus half the thickness,
// joined at the rim (a pillow).
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "kerf/base/hash.h"
#include "kerf/base/random.h"
#include "kerf/binding/cell_complex.h"
#include "kerf/binding/collision_mesh_build.h"
#include "kerf/mesh/half_edge_build.h"
#include "kerf/mesh/triangle_mesh.h"

namespace kerf::testing_support {

struct SyntheticOptions {
  int subdivisions = 3;    ///< 1-to-4 subdivisions of every collision triangle
  bool closed = false;     ///< two sides, joined at the rim
  double thickness = 0.1;  ///< metres; between the sides of a closed body
  double jitter = 0;       ///< planar positions of free vertices move by up to this part of a visual edge (below 0.25)
  double bump = 0;         ///< free vertices move along the normal by up to this, metres
  std::uint64_t seed = 1;
};

/// Grid of nx x ny quads over [0,size_x] x [0,size_y], z = 0, each quad in two triangles, or in four (X) where
/// quad_in_four(i, j) says so.
template <class Fn>
TriangleMesh grid_mesh(int nx, int ny, double size_x, double size_y, Fn&& quad_in_four) {
  TriangleMesh mesh;
  auto id = [&](int i, int j) { return VertexId(j * (nx + 1) + i); };
  for (int j = 0; j <= ny; ++j)
    for (int i = 0; i <= nx; ++i) mesh.positions.push_back({size_x * i / nx, size_y * j / ny, 0});
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      const VertexId a = id(i, j), b = id(i + 1, j), c = id(i + 1, j + 1), d = id(i, j + 1);
      if (quad_in_four(i, j)) {
        const VertexId m = mesh.positions.push_back({size_x * (i + 0.5) / nx, size_y * (j + 0.5) / ny, 0});
        mesh.triangles.push_back({a, b, m});
        mesh.triangles.push_back({b, c, m});
        mesh.triangles.push_back({c, d, m});
        mesh.triangles.push_back({d, a, m});
      } else if ((i + j) % 2 == 0) {
        mesh.triangles.push_back({a, b, c});
        mesh.triangles.push_back({a, c, d});
      } else {
        mesh.triangles.push_back({a, b, d});
        mesh.triangles.push_back({b, c, d});
      }
    }
  return mesh;
}

/// The 65-vertex, 104-triangle sheet of the paper's first experiment, 1 x 1 m: 6 x 6 quads, the inner 4 x 4 in four.
inline TriangleMesh sheet_65_mesh() {
  return grid_mesh(6, 6, 1, 1, [](int i, int j) { return i >= 1 && i <= 4 && j >= 1 && j <= 4; });
}
inline TriangleMesh plain_grid_mesh(int nx, int ny, double size_x = 1, double size_y = 1) {
  return grid_mesh(nx, ny, size_x, size_y, [](int, int) { return false; });
}
/// Ring between two radii in the plane z = 0 around the origin.
inline TriangleMesh annulus_mesh(double inner, double outer, int sectors, int rings) {
  TriangleMesh mesh;
  const double pi = 3.14159265358979323846;
  for (int r = 0; r <= rings; ++r)
    for (int s = 0; s < sectors; ++s) {
      const double radius = inner + (outer - inner) * r / rings, angle = 2 * pi * s / sectors;
      mesh.positions.push_back({radius * std::cos(angle), radius * std::sin(angle), 0});
    }
  for (int r = 0; r < rings; ++r)
    for (int s = 0; s < sectors; ++s) {
      const int t = (s + 1) % sectors;
      const VertexId a(r * sectors + s), b((r + 1) * sectors + s), c((r + 1) * sectors + t), d(r * sectors + t);
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    }
  return mesh;
}
/// Disc of a centre and rings of `sectors` vertices.
inline TriangleMesh disc_mesh(double radius, int sectors, int rings) {
  TriangleMesh mesh = annulus_mesh(radius / rings, radius, sectors, rings - 1);
  const VertexId centre = mesh.positions.push_back({0, 0, 0});
  for (int s = 0; s < sectors; ++s) mesh.triangles.push_back({centre, VertexId(s), VertexId((s + 1) % sectors)});
  return mesh;
}
/// Rolls a mesh in the xy-plane onto a cylinder of this radius with its axis along y (lengths along x are kept).
inline TriangleMesh bent_mesh(TriangleMesh mesh, double radius) {
  for (Vec3& p : mesh.positions) p = {radius * std::sin(p.x / radius), p.y, radius * (std::cos(p.x / radius) - 1)};
  return mesh;
}

/// The cell complex over a collision surface (an oriented manifold with border). Asserts on bad input; a closed body's
/// rim vertices must touch two triangles or more.
inline CellComplex make_synthetic_complex(const TriangleMesh& surface, const SyntheticOptions& options = {}) {
  using CH = CollisionHalfEdge;
  CellComplex body;
  body.closed = options.closed;
  const std::vector<double> half(surface.positions.size(), 0.5 * options.thickness);
  auto built = build_collision_mesh(surface, half);
  KERF_ASSERT(built.ok());
  body.collision = std::move(built).value();
  CollisionMesh& coarse = body.collision;
  const int n = 1 << options.subdivisions;
  const int sides = options.closed ? 2 : 1;
  const std::vector<Vec3> normals = vertex_normals(surface);

  std::vector<std::uint8_t> on_border(coarse.vertex_count(), 0);
  double length_sum = 0;
  std::size_t edge_count = 0;
  for (const CH h : ids<CH>(coarse.half_edge_count())) {
    if (coarse.is_border(h)) on_border[coarse.from(h).index()] = on_border[coarse.to(h).index()] = 1;
    if (coarse.twin[h].valid() && coarse.twin[h] < h) continue;
    length_sum += norm(coarse.rest[coarse.to(h)] - coarse.rest[coarse.from(h)]);
    ++edge_count;
  }
  body.mean_root_edge = length_sum / static_cast<double>(edge_count);

  std::vector<Vec3> rest, normal;
  std::vector<std::uint8_t> is_free;
  auto add_vertex = [&](Vec3 p, Vec3 nrm, bool free) {
    rest.push_back(p);
    normal.push_back(nrm);
    is_free.push_back(free ? 1 : 0);
    return VisualVertex(rest.size() - 1);
  };
  // Middle surface +- offset; a rim point of a closed body stays on the middle surface.
  auto side_offset = [&](CollisionVertex v, int s) {
    if (!options.closed || on_border[v.index()]) return Vec3{};
    return (s == 0 ? 1.0 : -1.0) * coarse.offset[v];
  };
  auto side_normal = [&](CollisionVertex v, int s) { return (s == 0 ? 1.0 : -1.0) * normals[v.index()]; };

  for (const CollisionVertex v : ids<CollisionVertex>(coarse.vertex_count())) {
    std::array<VisualVertex, 2> bound;
    bound[0] = add_vertex(coarse.rest[v] + side_offset(v, 0), side_normal(v, 0), false);
    if (options.closed)
      bound[1] =
          on_border[v.index()] ? bound[0] : add_vertex(coarse.rest[v] + side_offset(v, 1), side_normal(v, 1), false);
    coarse.bound.set(v, bound);
  }
  std::vector<VisualVertex> chain_pool;
  for (const CH h : ids<CH>(coarse.half_edge_count())) {
    const CH g = coarse.twin[h];
    if (g.valid() && g < h) continue;
    const CollisionVertex a = coarse.from(h), b = coarse.to(h);
    std::array<PoolRun, 2> runs;
    for (int s = 0; s < sides; ++s) {
      if (s == 1 && !g.valid()) {
        runs[1] = runs[0];
        break;
      }
      runs[static_cast<std::size_t>(s)] = {static_cast<std::int32_t>(chain_pool.size()), n - 1, false};
      for (int k = 1; k < n; ++k) {
        const double t = static_cast<double>(k) / n;
        Vec3 p = lerp(coarse.rest[a], coarse.rest[b], t);
        if (g.valid()) p += lerp(side_offset(a, s), side_offset(b, s), t);
        chain_pool.push_back(add_vertex(p, normalized(lerp(side_normal(a, s), side_normal(b, s), t)), false));
      }
    }
    coarse.chain.set(h, runs);
    if (g.valid()) {
      for (PoolRun& r : runs) r = r.exists() ? r.flipped() : r;
      coarse.chain.set(g, runs);
    }
  }

  Random random(options.seed);
  std::vector<std::array<std::int32_t, 3>> triangles;
  std::vector<Vec2> planar;
  std::vector<Vec2f> texture;
  std::vector<std::uint8_t> barrier;
  std::vector<Patch> patch;
  std::vector<VisualVertex> free_pool;
  for (const CollisionTriangle f : ids<CollisionTriangle>(coarse.face_count())) {
    std::array<PoolRun, 2> lists;
    for (int s = 0; s < sides; ++s) {
      const CH h[3] = {CollisionMesh::corner(f, 0), CollisionMesh::corner(f, 1), CollisionMesh::corner(f, 2)};
      // Lattice point (row, column): weight column of corner 1, row of corner 2, the rest of corner 0.
      auto at = [&](int row, int column) { return static_cast<std::size_t>(row * (n + 1) + column); };
      std::vector<VisualVertex> vertex(static_cast<std::size_t>((n + 1) * (n + 1)));
      std::vector<Vec2> uv(vertex.size());
      const auto first_free = static_cast<std::int32_t>(free_pool.size());
      for (int row = 0; row <= n; ++row)
        for (int column = 0; row + column <= n; ++column) {
          const int weight[3] = {n - row - column, column, row};
          const std::size_t here = at(row, column);
          Vec2 u;
          double w[3];
          for (int i = 0; i < 3; ++i) w[i] = static_cast<double>(weight[i]) / n;
          auto mix2 = [&] {
            u = {};
            for (int i = 0; i < 3; ++i) u = u + w[i] * coarse.planar[h[i]];
          };
          mix2();
          int zero = -1, full = -1;
          for (int i = 0; i < 3; ++i) {
            if (weight[i] == 0) zero = i;
            if (weight[i] == n) full = i;
          }
          if (full >= 0) {
            vertex[here] = coarse.bound[coarse.from(h[full])][static_cast<std::size_t>(s)];
            u = coarse.planar[h[full]];
          } else if (zero >= 0) {  // on the edge that starts at corner zero + 1
            const CH e = h[(zero + 1) % 3];
            const int k = weight[(zero + 2) % 3];
            vertex[here] = chain_pool[coarse.chain[e][static_cast<std::size_t>(s)].at(k - 1).index()];
            u = lerp(coarse.planar[e], coarse.planar[CollisionMesh::next(e)], static_cast<double>(k) / n);
          } else {
            Vec3 p, nrm;
            for (int i = 0; i < 3; ++i) {
              const CollisionVertex c = coarse.from(h[i]);
              p += w[i] * (coarse.rest[c] + side_offset(c, s));
              nrm += w[i] * side_normal(c, s);
            }
            nrm = normalized(nrm);
            if (options.bump > 0) p += random.uniform(-options.bump, options.bump) * nrm;
            if (options.jitter > 0) {
              const double d1 = random.uniform(-1, 1) * options.jitter / n,
                           d2 = random.uniform(-1, 1) * options.jitter / n;
              w[1] += d1;
              w[2] += d2;
              w[0] -= d1 + d2;
              mix2();
            }
            vertex[here] = add_vertex(p, nrm, true);
            free_pool.push_back(vertex[here]);
          }
          uv[here] = s == 0 ? u : Vec2{u.x, -u.y};
        }
      lists[static_cast<std::size_t>(s)] = {first_free, static_cast<std::int32_t>(free_pool.size()) - first_free,
                                            false};
      auto add_face = [&](std::array<std::array<int, 2>, 3> t) {
        if (s == 1) std::swap(t[1], t[2]);
        std::array<std::int32_t, 3> face{};
        for (std::size_t i = 0; i < 3; ++i) {
          const auto& q = t[i];
          const auto& r = t[(i + 1) % 3];
          face[i] = vertex[at(q[0], q[1])].value;
          planar.push_back(uv[at(q[0], q[1])]);
          const Vec3 p = rest[static_cast<std::size_t>(face[i])];
          texture.push_back({static_cast<float>(p.x), static_cast<float>(p.y)});
          const bool on_edge =
              (q[0] == 0 && r[0] == 0) || (q[1] == 0 && r[1] == 0) || (q[0] + q[1] == n && r[0] + r[1] == n);
          barrier.push_back(on_edge ? 1 : 0);
        }
        triangles.push_back(face);
        patch.push_back(Patch::of_root(coarse.root[f], static_cast<Side>(s)));
      };
      for (int row = 0; row < n; ++row)
        for (int column = 0; row + column < n; ++column) {
          add_face({{{row, column}, {row, column + 1}, {row + 1, column}}});
          if (row + column + 1 < n) add_face({{{row, column + 1}, {row + 1, column + 1}, {row + 1, column}}});
        }
    }
    coarse.free.set(f, lists);
  }

  auto connected = build_half_edges(triangles, rest.size());
  KERF_ASSERT(connected.ok());
  using VH = VisualHalfEdge;
  VisualMesh& fine = body.visual;
  std::vector<VisualVertex> origin;
  std::vector<VH> twin, outgoing;
  for (const auto& t : triangles)
    for (const std::int32_t v : t) origin.push_back(VisualVertex(v));
  for (const std::int32_t t : connected->twin) twin.push_back(VH(t));
  for (const std::int32_t h : connected->outgoing) outgoing.push_back(VH(h));
  std::vector<Vec3f> normal_f;
  for (const Vec3& nrm : normal) normal_f.push_back(to_float(nrm));
  fine.origin = Journaled<VH, VisualVertex>(std::move(origin));
  fine.twin = Journaled<VH, VH>(std::move(twin));
  fine.planar = Journaled<VH, Vec2>(std::move(planar));
  fine.outgoing = Journaled<VisualVertex, VH>(std::move(outgoing));
  fine.texture = Journaled<VH, Vec2f>(std::move(texture));
  fine.barrier = Journaled<VH, std::uint8_t>(std::move(barrier));
  fine.rest = Journaled<VisualVertex, Vec3>(std::move(rest));
  fine.normal = Journaled<VisualVertex, Vec3f>(std::move(normal_f));
  fine.free = Journaled<VisualVertex, std::uint8_t>(std::move(is_free));
  fine.patch = Journaled<VisualTriangle, Patch>(std::move(patch));
  body.chain_pool = Journaled<PoolIndex, VisualVertex>(std::move(chain_pool));
  body.free_pool = Journaled<PoolIndex, VisualVertex>(std::move(free_pool));
  return body;
}

namespace detail {
inline void hash_item(Hash& hash, const PoolRun& r) {
  hash.add(r.first);
  hash.add(r.count);
  hash.add(static_cast<std::int32_t>(r.reversed));
}
inline void hash_item(Hash& hash, const std::array<PoolRun, 2>& r) {
  hash_item(hash, r[0]);
  hash_item(hash, r[1]);
}
template <class T>
void hash_item(Hash& hash, const T& value) {
  hash.add(value);
}
}  // namespace detail

/// Hash of every item of every array: two complexes with the same hash hold the same bits.
inline std::uint64_t hash_of(CellComplex& body) {
  Hash hash;
  body.for_each_array([&](auto& array) {
    hash.add(array.size());
    for (const auto& item : array.raw()) detail::hash_item(hash, item);
  });
  return hash.value();
}

}  // namespace kerf::testing_support
