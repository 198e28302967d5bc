#include "kerf/binding/validate_binding.h"

#include <fmt/format.h>

#include <cmath>

#include "kerf/base/indexed.h"
#include "kerf/mesh/mesh_limits.h"
#include "kerf/spatial/predicates.h"

namespace kerf {
namespace {

/// A free vertex may lie outside its triangle by rounding only; fraction of the triangle's height.
constexpr double kOutsideSlack = 1e-12;

template <class... Args>
Error broken(fmt::format_string<Args...> text, Args&&... args) {
  return failed("bound body: " + fmt::format(text, std::forward<Args>(args)...));
}

/// Sizes, indices, twins, fans: the exact conditions under which the traversal functions are safe.
template <class Mesh>
Status check_half_edges(const HalfEdgeMesh<Mesh>& m, const char* name) {
  using H = typename HalfEdgeMesh<Mesh>::H;
  using V = typename HalfEdgeMesh<Mesh>::V;
  const std::size_t nh = m.half_edge_count(), nv = m.vertex_count();
  if (nh % 3 != 0 || m.twin.size() != nh || m.planar.size() != nh) return broken("{} mesh: array sizes disagree", name);
  for (const H h : ids<H>(nh))
    if (!m.outgoing.contains(m.origin[h]))
      return broken("{} mesh: half-edge {} starts at vertex {}, which does not exist", name, h.value,
                    m.origin[h].value);
  for (const H h : ids<H>(nh)) {
    if (m.from(h) == m.to(h))
      return broken("{} mesh: triangle {} uses vertex {} twice", name, h.value / 3 + 1, m.from(h).value + 1);
    const H t = m.twin[h];
    if (t.value == -1) continue;
    if (!m.twin.contains(t) || m.twin[t] != h || t == h)
      return broken("{} mesh: half-edge {} and its twin {} disagree", name, h.value, t.value);
    if (m.from(t) != m.to(h) || m.to(t) != m.from(h))
      return broken("{} mesh: the twin of half-edge {} joins other vertices", name, h.value);
  }
  for (const V v : ids<V>(nv)) {
    if (!m.origin.contains(m.outgoing[v]) || m.from(m.outgoing[v]) != v)
      return broken("{} mesh: vertex {} has no half-edge of its own", name, v.value + 1);
  }
  // Turning around a vertex follows a permutation of the half-edges, so it ends; together the fans must be everything.
  std::size_t met = 0;
  for (const V v : ids<V>(nv))
    m.for_each_outgoing(v, [&](H) {
      ++met;
      return true;
    });
  if (met != nh) return broken("{} mesh: some vertex joins parts that touch only there", name);
  // No two edges with the same ends: mark the neighbours of each vertex in turn.
  std::vector<std::int32_t> seen(nv, -1);
  for (const V v : ids<V>(nv)) {
    bool repeated = false;
    m.for_each_outgoing(v, [&](H h) {
      auto& mark = seen[m.to(h).index()];
      repeated |= mark == v.value;
      mark = v.value;
      return true;
    });
    if (repeated) return broken("{} mesh: vertex {} has two edges to the same neighbour", name, v.value + 1);
  }
  return {};
}

template <class Mesh>
std::int64_t euler_characteristic(const HalfEdgeMesh<Mesh>& m) {
  std::int64_t borders = 0;
  using H = typename HalfEdgeMesh<Mesh>::H;
  for (const H h : ids<H>(m.half_edge_count())) borders += m.is_border(h);
  const auto half_edges = static_cast<std::int64_t>(m.half_edge_count());
  return static_cast<std::int64_t>(m.vertex_count()) - (half_edges + borders) / 2 + half_edges / 3;
}

bool valid_run(PoolRun run, std::size_t pool) {
  return !run.exists() || (run.first >= 0 && static_cast<std::size_t>(run.first) <= pool &&
                           static_cast<std::size_t>(run.count) <= pool - static_cast<std::size_t>(run.first));
}

Status check_sizes(const CellComplex& x) {
  const CollisionMesh& c = x.collision;
  const VisualMesh& v = x.visual;
  const std::size_t ch = c.half_edge_count(), cv = c.vertex_count(), cf = c.face_count();
  if (c.chain.size() != ch || c.wall.size() != ch || c.rest.size() != cv || c.offset.size() != cv ||
      c.bound.size() != cv || c.line.size() != cv || c.ancestor.size() != cv || c.root.size() != cf ||
      c.free.size() != cf)
    return broken("collision mesh: array sizes disagree");
  const std::size_t vh = v.half_edge_count(), vv = v.vertex_count();
  if (v.texture.size() != vh || v.barrier.size() != vh || v.rest.size() != vv || v.normal.size() != vv ||
      v.free.size() != vv || v.patch.size() != v.face_count())
    return broken("visual mesh: array sizes disagree");
  if (x.wall_edge.size() + x.wall_inner.size() + x.wall_pool.size() > 0)
    return broken("it has walls, but no cut was made yet");
  for (const auto* pool : {&x.chain_pool, &x.free_pool})
    for (const VisualVertex i : pool->raw())
      if (!v.outgoing.contains(i)) return broken("a list holds visual vertex {}, which does not exist", i.value);
  for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(ch)) {
    if (c.wall[h].valid()) return broken("collision half-edge {} has a wall, but no cut was made yet", h.value);
    for (const PoolRun run : c.chain[h])
      if (!valid_run(run, x.chain_pool.size()))
        return broken("the chain of collision half-edge {} lies outside its pool", h.value);
  }
  for (const CollisionTriangle f : ids<CollisionTriangle>(cf))
    for (const PoolRun run : c.free[f])
      if (!valid_run(run, x.free_pool.size()))
        return broken("the free list of collision triangle {} lies outside its pool", f.value + 1);
  for (const CollisionVertex i : ids<CollisionVertex>(cv)) {
    if (c.line[i].exists()) return broken("collision vertex {} has a line, but no cut was made yet", i.value + 1);
    for (std::size_t side = 0; side < (x.closed ? 2u : 1u); ++side)
      if (!v.outgoing.contains(c.bound[i][side]))
        return broken("collision vertex {} is bound to no visual vertex", i.value + 1);
    if (!x.closed && c.bound[i][1].valid())
      return broken("collision vertex {} of an open sheet has a - side", i.value + 1);
    if (!is_finite(c.rest[i]) || !is_finite(c.offset[i]))
      return broken("collision vertex {} is not finite", i.value + 1);
    if (c.ancestor[i] != i) return broken("collision vertex {} has an ancestor, but no cut was made yet", i.value + 1);
  }
  for (const VisualVertex i : ids<VisualVertex>(vv))
    if (!is_finite(v.rest[i]) || !is_finite(to_double(v.normal[i])))
      return broken("visual vertex {} is not finite", i.value + 1);
  for (const VisualHalfEdge h : ids<VisualHalfEdge>(v.texture.size()))
    if (!is_texture_coordinate(v.texture[h].x) || !is_texture_coordinate(v.texture[h].y))
      return broken("visual half-edge {} has a texture coordinate that is not finite, or beyond {:g}", h.value + 1,
                    kMostTexture);
  for (std::size_t f = 0; f < cf; ++f)
    if (c.root[CollisionTriangle(f)] != RootId(f)) return broken("collision triangle {} is not its own root", f + 1);
  for (const VisualTriangle f : ids<VisualTriangle>(v.face_count())) {
    const Patch p = v.patch[f];
    if (p.value < 0 || static_cast<std::size_t>(p.value) >= 2 * cf || (!x.closed && p.side() == Side::kMinus))
      return broken("visual triangle {} belongs to patch {}, which does not exist", f.value + 1, p.value);
  }
  if (!(x.mean_root_edge > 0 && std::isfinite(x.mean_root_edge)))
    return broken("its mean edge length is {}", x.mean_root_edge);
  return {};
}

Status check_topology(const CellComplex& x) {
  const std::int64_t coarse = euler_characteristic(x.collision), fine = euler_characteristic(x.visual);
  if (fine != (x.closed ? 2 : 1) * coarse)
    return broken("the visual mesh has Euler characteristic {}, the collision mesh {}: not the same shape", fine,
                  coarse);
  if (x.closed)
    for (const VisualHalfEdge h : ids<VisualHalfEdge>(x.visual.half_edge_count()))
      if (x.visual.is_border(h))
        return broken("the closed visual mesh has a border at vertex {}", x.visual.from(h).value + 1);
  return {};
}

Vec2 mirrored(Vec2 p, Side side) { return side == Side::kPlus ? p : Vec2{p.x, -p.y}; }

Status check_planes(const CellComplex& x) {
  const VisualMesh& v = x.visual;
  const CollisionMesh& c = x.collision;
  for (const CollisionTriangle f : ids<CollisionTriangle>(c.face_count())) {
    const Vec2 a = c.planar[CollisionMesh::corner(f, 0)], b = c.planar[CollisionMesh::corner(f, 1)],
               d = c.planar[CollisionMesh::corner(f, 2)];
    if (!std::isfinite(a.x + a.y + b.x + b.y + d.x + d.y) || orient2d(a, b, d) <= 0)
      return broken("collision triangle {} is not positively oriented in its plane", f.value + 1);
  }
  for (const VisualTriangle f : ids<VisualTriangle>(v.face_count())) {
    const Vec2 a = v.planar[VisualMesh::corner(f, 0)], b = v.planar[VisualMesh::corner(f, 1)],
               d = v.planar[VisualMesh::corner(f, 2)];
    if (!std::isfinite(a.x + a.y + b.x + b.y + d.x + d.y) || orient2d(a, b, d) <= 0)
      return broken("visual triangle {} is not positively oriented in its plane", f.value + 1);
  }
  // Faces of one patch around a vertex are neighbours or meet at a bound vertex; compare with the first corner per patch.
  std::vector<std::pair<std::int32_t, Vec2>> planes;
  for (const VisualVertex i : ids<VisualVertex>(v.vertex_count())) {
    planes.clear();
    bool same = true;
    v.for_each_outgoing(i, [&](VisualHalfEdge h) {
      const std::int32_t patch = v.patch[VisualMesh::face(h)].value;
      for (const auto& [known, p] : planes)
        if (known == patch) {
          same &= p == v.planar[h];
          return true;
        }
      planes.emplace_back(patch, v.planar[h]);
      return true;
    });
    if (!same) return broken("the corners of visual vertex {} differ in one plane", i.value + 1);
  }
  return {};
}

Status check_table(const CellComplex& x) {
  const VisualMesh& v = x.visual;
  const CollisionMesh& c = x.collision;
  const std::size_t sides = x.closed ? 2 : 1;

  // 1: bound, 2: on a chain, 3: in a free list. Each vertex exactly one of them.
  std::vector<std::uint8_t> role(v.vertex_count(), 0);
  for (const CollisionVertex i : ids<CollisionVertex>(c.vertex_count())) {
    const bool rim = c.on_border(i);
    if (x.closed && (c.bound[i][0] == c.bound[i][1]) != rim)
      return broken("collision vertex {}: + and - must be bound to one visual vertex on the rim and to two inside",
                    i.value + 1);
    for (std::size_t side = 0; side < (x.closed && !rim ? 2u : 1u); ++side) {
      std::uint8_t& r = role[c.bound[i][side].index()];
      if (r) return broken("visual vertex {} is bound twice", c.bound[i][side].value + 1);
      r = 1;
    }
  }
  const std::size_t patches = 2 * c.face_count();
  std::vector<std::int64_t> boundary(patches, 0);
  std::int64_t chain_edges = 0;  // directed
  std::vector<std::int32_t> chain_mark(v.half_edge_count(), -1);
  for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(c.half_edge_count())) {
    const CollisionHalfEdge t = c.twin[h];
    for (std::size_t side = 0; side < 2; ++side) {
      const PoolRun run = c.chain[h][side];
      if (run.exists() != (side < sides))
        return broken("collision half-edge {}: chain missing, or one too many", h.value);
      if (!run.exists()) continue;
      const auto same = [](PoolRun a, PoolRun b) {
        return a.first == b.first && a.count == b.count && (a.count == 0 || a.reversed == b.reversed);
      };
      if (t.valid() && !same(c.chain[t][side], run.flipped()))
        return broken("collision half-edge {}: its twin has another chain", h.value);
      if (!t.valid() && !same(c.chain[h][0], run))
        return broken("collision half-edge {}: two chains on the rim", h.value);
      const bool owner = (!t.valid() && side == 0) || (t.valid() && h < t);
      const auto patch = Patch::of_root(c.root[CollisionMesh::face(h)], kSides[side]);
      const Vec2 a = c.planar[h], b = c.planar[CollisionMesh::next(h)];
      VisualVertex last = c.bound[c.from(h)][side];
      double last_t = 0;
      for (std::int32_t i = 0; i <= run.count; ++i) {
        const VisualVertex next = i < run.count ? x.chain_pool[run.at(i)] : c.bound[c.to(h)][side];
        if (i < run.count && owner) {
          if (role[next.index()]) return broken("visual vertex {} is on two chains", next.value + 1);
          role[next.index()] = 2;
        }
        const VisualHalfEdge e = side == 0 ? v.find_half_edge(last, next) : v.find_half_edge(next, last);
        if (!e.valid())
          return broken("chain of collision half-edge {}: visual vertices {} and {} are no neighbours", h.value,
                        last.value + 1, next.value + 1);
        if (v.patch[VisualMesh::face(e)] != patch)
          return broken(
              "chain of collision half-edge {}: the triangle beside visual vertex {} belongs to another patch", h.value,
              last.value + 1);
        if (!v.barrier[e] || chain_mark[e.index()] >= 0)
          return broken("chain of collision half-edge {}: edge {}-{} is no barrier or is used twice", h.value,
                        last.value + 1, next.value + 1);
        chain_mark[e.index()] = h.value;
        ++chain_edges;
        ++boundary[static_cast<std::size_t>(patch.value)];
        // In the plane: on the edge, in order; the ends have the bits of the collision corners.
        const VisualHalfEdge corner_next = side == 0 ? VisualMesh::next(e) : e;
        const VisualHalfEdge corner_last = side == 0 ? e : VisualMesh::next(e);
        const Vec2 p = mirrored(v.planar[corner_next], kSides[side]);
        if (i == 0 && !(mirrored(v.planar[corner_last], kSides[side]) == a))
          return broken("visual vertex {}: not at its collision corner in the plane", last.value + 1);
        if (i == run.count && !(p == b))
          return broken("visual vertex {}: not at its collision corner in the plane", next.value + 1);
        const double length2 = dot(b - a, b - a), along = dot(p - a, b - a) / length2,
                     off = cross(b - a, p - a) / length2;
        if (std::fabs(off) > kOutsideSlack)
          return broken("visual vertex {}: off its collision edge in the plane", next.value + 1);
        if (!(along > last_t))
          return broken("chain of collision half-edge {}: visual vertex {} is out of order", h.value, next.value + 1);
        last_t = along;
        last = next;
      }
    }
  }
  std::int64_t barriers = 0;
  for (const VisualHalfEdge h : ids<VisualHalfEdge>(v.half_edge_count())) {
    barriers += v.barrier[h];
    if (v.barrier[h] > 1) return broken("the barrier flag of visual half-edge {} is {}", h.value, v.barrier[h]);
    const VisualHalfEdge t = v.twin[h];
    if (!t.valid() ? !v.barrier[h] : v.barrier[h] != v.barrier[t])
      return broken("visual half-edge {}: barrier flag differs from its twin's, or missing on the border", h.value);
    if (t.valid() && !v.barrier[h] && v.patch[VisualMesh::face(h)] != v.patch[VisualMesh::face(t)])
      return broken("visual triangles {} and {} belong to different patches without a path between them",
                    h.value / 3 + 1, t.value / 3 + 1);
  }
  if (barriers != chain_edges) return broken("{} barrier edges, but {} on chains", barriers, chain_edges);

  for (const CollisionTriangle f : ids<CollisionTriangle>(c.face_count()))
    for (std::size_t side = 0; side < 2; ++side) {
      const PoolRun run = c.free[f][side];
      if (run.exists() != (side < sides))
        return broken("collision triangle {}: free list missing, or one too many", f.value + 1);
      for (std::int32_t i = 0; i < run.count; ++i) {
        const VisualVertex u = x.free_pool[run.at(i)];
        if (role[u.index()]) return broken("visual vertex {} is in two lists", u.value + 1);
        role[u.index()] = 3;
        const VisualHalfEdge h = v.outgoing[u];
        if (v.patch[VisualMesh::face(h)] != Patch::of_root(c.root[f], kSides[side]))
          return broken("visual vertex {} is in the list of another patch", u.value + 1);
        const Vec2 p = mirrored(v.planar[h], kSides[side]);
        for (int k = 0; k < 3; ++k) {
          const Vec2 a = c.planar[CollisionMesh::corner(f, k)], b = c.planar[CollisionMesh::corner(f, (k + 1) % 3)];
          if (cross(b - a, p - a) < -kOutsideSlack * dot(b - a, b - a))
            return broken("visual vertex {} lies outside collision triangle {} in its plane", u.value + 1, f.value + 1);
        }
      }
    }
  for (const VisualVertex i : ids<VisualVertex>(v.vertex_count())) {
    if (!role[i.index()]) return broken("visual vertex {} belongs to nothing", i.value + 1);
    if ((role[i.index()] == 3) != (v.free[i] == 1) || v.free[i] > 1)
      return broken("the free flag of visual vertex {} is wrong", i.value + 1);
  }

  // Every patch a disc: bounded by one simple closed chain, V - E + F = 1.
  std::vector<std::int64_t> faces(patches, 0);
  for (const Patch p : v.patch.raw()) ++faces[static_cast<std::size_t>(p.value)];
  for (const CollisionTriangle f : ids<CollisionTriangle>(c.face_count()))
    for (std::size_t side = 0; side < sides; ++side) {
      const auto p = static_cast<std::size_t>(Patch::of_root(c.root[f], kSides[side]).value);
      const std::int64_t euler = c.free[f][side].count + boundary[p] - (3 * faces[p] + boundary[p]) / 2 + faces[p];
      if (euler != 1)
        return broken("the patch of collision triangle {} ({} side) is no disc: V - E + F = {}", f.value + 1,
                      side == 0 ? "+" : "-", euler);
    }
  return {};
}

}  // namespace

Status validate_binding(const CellComplex& complex) {
  KERF_TRY(check_half_edges(complex.collision, "collision"));
  KERF_TRY(check_half_edges(complex.visual, "visual"));
  KERF_TRY(check_sizes(complex));
  KERF_TRY(check_topology(complex));
  KERF_TRY(check_planes(complex));
  KERF_TRY(check_table(complex));
  return {};
}

}  // namespace kerf
