#include "kerf/cutting/collision_split.h"

#include <algorithm>

#include "kerf/cutting/chain_split.h"
#include "kerf/cutting/free_list.h"
#include "kerf/cutting/half_edge_split.h"
#include "kerf/cutting/orient.h"
#include "kerf/cutting/tolerances.h"
#include "kerf/cutting/visual_walk.h"
#include "kerf/cutting/wall.h"

namespace kerf::cut {

namespace {

using H = CollisionHalfEdge;
using V = CollisionVertex;
using F = CollisionTriangle;

constexpr PoolRun kNoRun{};
constexpr std::array<PoolRun, 2> kNoRuns{};

V append_collision_vertex(CellComplex& body, Vec3 rest, Vec3 offset, std::array<VisualVertex, 2> bound) {
  CollisionMesh& mesh = body.collision;
  const V m = mesh.outgoing.push_back(H{});
  mesh.rest.push_back(rest);
  mesh.offset.push_back(offset);
  mesh.bound.push_back(bound);
  mesh.line.push_back(kNoRun);
  mesh.ancestor.push_back(m);
  return m;
}

/// Moves what half-edge `from` carries to the newly appended half-edges of a face, in order.
void push_payload(CollisionMesh& mesh, const std::array<PoolRun, 2>& chain, WallId wall) {
  mesh.chain.push_back(chain);
  mesh.wall.push_back(wall);
}

void set_payload(CellComplex& body, H h, const std::array<PoolRun, 2>& chain, WallId wall) {
  body.collision.chain.set(h, chain);
  if (body.collision.wall[h] != wall) body.collision.wall.set(h, wall);
  if (wall.valid()) body.wall_edge.set(wall, h);
}

bool is_large_enough(const CellComplex& body, Vec2 a, Vec2 b, Vec2 c) {
  return orient(a, b, c) > kLeastCollisionArea * body.mean_root_edge * body.mean_root_edge;
}

/// Do the four vertices around an edge lie in one plane, and their offsets too, as the corners of a root triangle cut up do? Where a shaver
/// moved them they may not, and turning the edge would change the body.
bool is_flat(const CellComplex& body, H h, H g) {
  const CollisionMesh& mesh = body.collision;
  const H hn = CollisionMesh::next(h), hp = CollisionMesh::prev(h), gp = CollisionMesh::prev(g);
  const Vec2 a = mesh.planar[h], b = mesh.planar[hn], c = mesh.planar[hp], d = mesh.planar[gp];
  const double whole = orient(a, b, c), wb = orient(a, d, c) / whole, wc = orient(a, b, d) / whole;
  const auto strays = [&](const auto& array) {
    const Vec3 x = array[mesh.from(h)];
    return norm(x + wb * (array[mesh.to(h)] - x) + wc * (array[mesh.apex(h)] - x) - array[mesh.apex(g)]);
  };
  return strays(mesh.rest) + strays(mesh.offset) < kFlatness * body.mean_root_edge;
}

void push_face_edges(CutContext& cut, F f) {
  for (int i = 0; i < 3; ++i) cut.scratch.flip_stack.push_back(CollisionMesh::corner(f, i));
}

}  // namespace

V split_collision_edge(CutContext& cut, H h, double t) {
  CellComplex& body = cut.body;
  CollisionMesh& mesh = body.collision;
  const H g = mesh.twin[h], hn = CollisionMesh::next(h), hp = CollisionMesh::prev(h);
  const V a = mesh.from(h), b = mesh.to(h), c = mesh.apex(h);
  const F f = CollisionMesh::face(h);
  const Vec2 ua = mesh.planar[h], ub = mesh.planar[hn], uc = mesh.planar[hp];
  const Vec2 u_left = lerp(ua, ub, t);
  if (!is_large_enough(body, ua, u_left, uc) || !is_large_enough(body, u_left, ub, uc)) {
    cut.fail("a collision triangle is too thin to cut", "collision triangle", f.value);
    return {};
  }
  Vec2 u_right, ud, uag, ubg;
  V d;
  if (g.valid()) {
    uag = mesh.planar[CollisionMesh::next(g)];
    ubg = mesh.planar[g];
    ud = mesh.planar[CollisionMesh::prev(g)];
    d = mesh.apex(g);
    u_right = lerp(uag, ubg, t);
    if (!is_large_enough(body, u_right, uag, ud) || !is_large_enough(body, ubg, u_right, ud)) {
      cut.fail("a collision triangle is too thin to cut", "collision triangle", CollisionMesh::face(g).value);
      return {};
    }
  }

  // The visual mesh.
  const bool has_chain = mesh.has_chain(h);
  const WallId wall = mesh.wall[h];
  const bool rim = body.closed && !g.valid() && !wall.valid();
  const int sides = rim ? 1 : side_count(body);
  std::array<VisualVertex, 2> bound;
  std::array<PoolRun, 2> near = kNoRuns, far = kNoRuns;  // the chains of a -> m and m -> b
  for (int i = 0; i < sides; ++i) {
    const auto s = static_cast<std::size_t>(i);
    const Side side = static_cast<Side>(i);
    if (has_chain) {
      const ChainCut chain = cut_chain(cut, h, side, t, u_left, u_right);
      if (!chain.vertex.valid()) return {};
      bound[s] = chain.vertex;
      const PoolRun run = mesh.chain[h][s];
      near[s] = run.part(0, chain.before);
      far[s] = run.part(chain.after_from, run.count - chain.after_from);
    } else {
      bound[s] = insert_point(cut, mesh.bound[c][s], mirrored(u_left, side), Patch::of_root(mesh.root[f], side));
      if (!bound[s].valid()) return {};
    }
  }
  if (rim) {
    bound[1] = bound[0];
    near[1] = near[0];
    far[1] = far[0];
  }
  WallId far_wall;
  PoolRun line = kNoRun;
  if (wall.valid()) {
    far_wall = cut_wall(cut, wall, bound, line);
    if (!far_wall.valid()) return {};
  }

  // The collision mesh.
  const std::array<PoolRun, 2> lists = mesh.free[f];
  const std::array<PoolRun, 2> lists_right = g.valid() ? mesh.free[CollisionMesh::face(g)] : kNoRuns;
  // At the same place to the bit as the vertex that cuts the other lip there.
  const Vec3 place = is_less(mesh.rest[b], mesh.rest[a]) ? lerp(mesh.rest[b], mesh.rest[a], 1 - t)
                                                         : lerp(mesh.rest[a], mesh.rest[b], t);
  const V m = append_collision_vertex(body, place, lerp(mesh.offset[a], mesh.offset[b], t), bound);
  if (line.exists()) mesh.line.set(m, line);
  cut.scratch.note_birth({m, {a, b, V{}}, {1 - t, t, 0}});
  const std::array<PoolRun, 2> moved_chain = mesh.chain[hn];
  const WallId moved_wall = mesh.wall[hn];
  const H gp = g.valid() ? CollisionMesh::prev(g) : H{};
  const std::array<PoolRun, 2> moved_chain_right = g.valid() ? mesh.chain[gp] : kNoRuns;
  const WallId moved_wall_right = g.valid() ? mesh.wall[gp] : WallId{};

  const EdgeSplit<CollisionMesh> split = split_edge_topology(mesh, h, m, u_left, u_right);
  for (int i = 0; i < 3; ++i) push_payload(mesh, kNoRuns, WallId{});
  mesh.root.push_back(mesh.root[f]);
  mesh.free.push_back(kNoRuns);
  if (g.valid()) {
    for (int i = 0; i < 3; ++i) push_payload(mesh, kNoRuns, WallId{});
    mesh.root.push_back(mesh.root[CollisionMesh::face(g)]);
    mesh.free.push_back(kNoRuns);
  }
  set_payload(body, CollisionMesh::corner(split.left, 0), far, far_wall);
  set_payload(body, CollisionMesh::corner(split.left, 1), moved_chain, moved_wall);
  mesh.chain.set(h, near);
  if (moved_chain[0].exists()) set_payload(body, hn, kNoRuns, WallId{});
  {
    const F into[2] = {split.left, f};
    const Vec2 corner[2] = {ub, uc};
    divide_free_lists(cut, lists, into, 2, u_left, corner);  // m -> c: a m c lies on its left
  }
  if (g.valid()) {
    const auto flipped = [](std::array<PoolRun, 2> runs) {
      for (PoolRun& r : runs)
        if (r.exists()) r = r.flipped();
      return runs;
    };
    set_payload(body, CollisionMesh::corner(split.right, 0), flipped(far), WallId{});
    set_payload(body, CollisionMesh::corner(split.right, 2), moved_chain_right, moved_wall_right);
    mesh.chain.set(g, flipped(near));
    if (moved_chain_right[0].exists()) set_payload(body, gp, kNoRuns, WallId{});
    const F into[2] = {CollisionMesh::face(g), split.right};
    const Vec2 corner[2] = {uag, ud};
    divide_free_lists(cut, lists_right, into, 2, u_right, corner);  // m -> d: b m d lies on its left
  }
  if (cut.options.flips) {
    push_face_edges(cut, f);
    push_face_edges(cut, split.left);
    if (g.valid()) {
      push_face_edges(cut, CollisionMesh::face(g));
      push_face_edges(cut, split.right);
    }
  }
  return m;
}

V split_collision_face(CutContext& cut, F f, Vec2 u, const std::array<double, 3>& weights) {
  CellComplex& body = cut.body;
  CollisionMesh& mesh = body.collision;
  const H h[3] = {CollisionMesh::corner(f, 0), CollisionMesh::corner(f, 1), CollisionMesh::corner(f, 2)};
  const V v[3] = {mesh.origin[h[0]], mesh.origin[h[1]], mesh.origin[h[2]]};
  const Vec2 p[3] = {mesh.planar[h[0]], mesh.planar[h[1]], mesh.planar[h[2]]};
  for (int i = 0; i < 3; ++i)
    if (!is_large_enough(body, p[i], p[(i + 1) % 3], u)) {
      cut.fail("the tip lies on the edge of a collision triangle", "collision triangle", f.value);
      return {};
    }
  std::array<VisualVertex, 2> bound;
  for (int i = 0; i < side_count(body); ++i) {
    const auto s = static_cast<std::size_t>(i);
    const Side side = static_cast<Side>(i);
    bound[s] = insert_point(cut, mesh.bound[v[0]][s], mirrored(u, side), Patch::of_root(mesh.root[f], side));
    if (!bound[s].valid()) return {};
  }
  Vec3 rest, offset;
  for (std::size_t i = 0; i < 3; ++i) {
    rest += weights[i] * mesh.rest[v[i]];
    offset += weights[i] * mesh.offset[v[i]];
  }
  const std::array<PoolRun, 2> lists = mesh.free[f];
  const V m = append_collision_vertex(body, rest, offset, bound);
  cut.scratch.note_birth({m, {v[0], v[1], v[2]}, weights});
  const std::array<PoolRun, 2> chain1 = mesh.chain[h[1]], chain2 = mesh.chain[h[2]];
  const WallId wall1 = mesh.wall[h[1]], wall2 = mesh.wall[h[2]];
  const FaceSplit<CollisionMesh> split = split_face_topology(mesh, f, m, u);
  for (int i = 0; i < 6; ++i) push_payload(mesh, kNoRuns, WallId{});
  for (int i = 0; i < 2; ++i) {
    mesh.root.push_back(mesh.root[f]);
    mesh.free.push_back(kNoRuns);
  }
  set_payload(body, CollisionMesh::corner(split.second, 0), chain1, wall1);
  set_payload(body, CollisionMesh::corner(split.third, 0), chain2, wall2);
  if (chain1[0].exists()) set_payload(body, h[1], kNoRuns, WallId{});
  if (chain2[0].exists()) set_payload(body, h[2], kNoRuns, WallId{});
  const F into[3] = {f, split.second, split.third};
  divide_free_lists(cut, lists, into, 3, u, p);
  if (cut.options.flips)
    for (const F face : into) push_face_edges(cut, face);
  return m;
}

void flip_to_delaunay(CutContext& cut) { flip_to_delaunay(cut, {}); }

void flip_to_delaunay(CutContext& cut, std::span<const F> keep) {
  CellComplex& body = cut.body;
  CollisionMesh& mesh = body.collision;
  auto& stack = cut.scratch.flip_stack;
  const double least_edge =
      kLeastCollisionEdge * std::max(cut.options.minimum_feature, kLeastFeature) * body.mean_root_edge;
  std::size_t limit = 16 * stack.size() + 64;  // Lawson ends; rounding must not keep it going
  while (!stack.empty() && limit-- > 0) {
    const H h = stack.back();
    stack.pop_back();
    const H g = mesh.twin[h];
    if (!g.valid() || mesh.has_chain(h)) continue;
    const H hp = CollisionMesh::prev(h), gp = CollisionMesh::prev(g), hn = CollisionMesh::next(h),
            gn = CollisionMesh::next(g);
    const Vec2 a = mesh.planar[h], b = mesh.planar[hn], c = mesh.planar[hp], d = mesh.planar[gp];
    const double sin_c = cross(a - c, b - c), cos_c = dot(a - c, b - c);
    const double sin_d = cross(b - d, a - d), cos_d = dot(b - d, a - d);
    const double size = std::sqrt((sin_c * sin_c + cos_c * cos_c) * (sin_d * sin_d + cos_d * cos_d));
    if (!(sin_c * cos_d + cos_c * sin_d < -kFlipGain * size)) continue;
    if (!is_large_enough(body, a, d, c) || !is_large_enough(body, b, c, d)) continue;
    if (norm(mesh.rest[mesh.apex(g)] - mesh.rest[mesh.apex(h)]) < least_edge) continue;
    if (!is_flat(body, h, g)) continue;
    if (mesh.find_half_edge(mesh.apex(h), mesh.apex(g)).valid() ||
        mesh.find_half_edge(mesh.apex(g), mesh.apex(h)).valid())
      continue;  // already joined by an edge (the lips of a slit)
    const F f1 = CollisionMesh::face(h), f2 = CollisionMesh::face(g);
    if (std::any_of(keep.begin(), keep.end(), [&](F f) { return f == f1 || f == f2; })) continue;
    const std::array<PoolRun, 2> lists = joined_free_lists(cut, f1, f2);
    const std::array<PoolRun, 2> chain_h = mesh.chain[gn], chain_g = mesh.chain[hn];
    const WallId wall_h = mesh.wall[gn], wall_g = mesh.wall[hn];
    flip_edge_topology(mesh, h);
    set_payload(body, h, chain_h, wall_h);
    set_payload(body, g, chain_g, wall_g);
    set_payload(body, hn, kNoRuns, WallId{});
    set_payload(body, gn, kNoRuns, WallId{});
    const F into[2] = {f2, f1};
    const Vec2 corner[2] = {b, c};
    divide_free_lists(cut, lists, into, 2, d, corner);  // d -> c: a d c lies on its left
    for (const H e : {h, hp, g, gp}) stack.push_back(e);
  }
  stack.clear();
}

}  // namespace kerf::cut
