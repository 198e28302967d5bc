// Splitting an edge and a face, flipping an edge, renaming a fan: topology shared by both meshes. Payload is the
// caller's. Ids stay: of a face a b c split at m on a b, h becomes a -> m in place, and only b -> c moves.
#pragma once

#include "kerf/mesh/half_edge.h"

namespace kerf::cut {

/// Calls f(h) for every outgoing half-edge of v, in no particular order, until f returns false. Reads no vertex ids
/// on the way, so f may rename v.
template <class M, class Fn>
void for_each_corner(const M& mesh, typename M::V v, Fn&& f) {
  const typename M::H start = mesh.outgoing[v];
  typename M::H h = start;
  do {
    if (!f(h)) return;
    h = mesh.ccw(h);
  } while (h.valid() && h != start);
  if (h.valid()) return;
  for (h = mesh.cw(start); h.valid(); h = mesh.cw(h))
    if (!f(h)) return;
}

/// Renames the fan component that holds the outgoing half-edge `from`.
template <class M>
void rename_fan(M& mesh, typename M::H from, typename M::V name) {
  typename M::H h = from;
  do {
    mesh.origin.set(h, name);
    h = mesh.ccw(h);
  } while (h.valid() && h != from);
  if (h.valid()) return;
  for (h = mesh.cw(from); h.valid(); h = mesh.cw(h)) mesh.origin.set(h, name);
}

template <class M>
void link(M& mesh, typename M::H a, typename M::H b) {
  if (a.valid()) mesh.twin.set(a, b);
  if (b.valid()) mesh.twin.set(b, a);
}

template <class M>
typename M::F append_face(M& mesh, typename M::V a, typename M::V b, typename M::V c, Vec2 ua, Vec2 ub, Vec2 uc) {
  using H = typename M::H;
  const typename M::F f(mesh.face_count());
  mesh.origin.push_back(a);
  mesh.origin.push_back(b);
  mesh.origin.push_back(c);
  mesh.planar.push_back(ua);
  mesh.planar.push_back(ub);
  mesh.planar.push_back(uc);
  for (int i = 0; i < 3; ++i) mesh.twin.push_back(H{});
  return f;
}

/// left: face m b c (corners 0, 1, 2), right: face b m d; moved payload: next(h) -> corner 1, prev(twin) -> corner 2.
template <class M>
struct EdgeSplit {
  typename M::F left, right;
};

/// Splits h: a -> b at the new vertex m (already appended to `outgoing`), which lies at u_left in h's face and at
/// u_right in its twin's. Afterwards h is a -> m, twin(h) is m -> a.
template <class M>
EdgeSplit<M> split_edge_topology(M& mesh, typename M::H h, typename M::V m, Vec2 u_left, Vec2 u_right) {
  using H = typename M::H;
  const H g = mesh.twin[h], hn = M::next(h), hp = M::prev(h);
  const typename M::V b = mesh.origin[hn], c = mesh.origin[hp];
  EdgeSplit<M> result;
  const H moved_twin = mesh.twin[hn];
  result.left = append_face(mesh, m, b, c, u_left, mesh.planar[hn], mesh.planar[hp]);
  const H l0 = M::corner(result.left, 0), l1 = M::corner(result.left, 1), l2 = M::corner(result.left, 2);
  link(mesh, l1, moved_twin);
  link(mesh, hn, l2);
  if (mesh.outgoing[b] == hn) mesh.outgoing.set(b, l1);
  mesh.origin.set(hn, m);
  mesh.planar.set(hn, u_left);
  if (g.valid()) {
    const H gp = M::prev(g);
    const typename M::V d = mesh.origin[gp];
    const H other_twin = mesh.twin[gp];
    result.right = append_face(mesh, b, m, d, mesh.planar[g], u_right, mesh.planar[gp]);
    const H r0 = M::corner(result.right, 0), r1 = M::corner(result.right, 1), r2 = M::corner(result.right, 2);
    link(mesh, r2, other_twin);
    link(mesh, gp, r1);
    link(mesh, l0, r0);
    if (mesh.outgoing[b] == g) mesh.outgoing.set(b, r0);
    mesh.origin.set(g, m);
    mesh.planar.set(g, u_right);
  }
  mesh.outgoing.set(m, hn);
  return result;
}

/// Faces a b m (the old one), b c m and c a m.
template <class M>
struct FaceSplit {
  typename M::F second, third;
};

/// Splits face f = a b c at the new vertex m. Payload: corner 1 -> second's corner 0, corner 2 -> third's corner 0.
template <class M>
FaceSplit<M> split_face_topology(M& mesh, typename M::F f, typename M::V m, Vec2 u) {
  using H = typename M::H;
  const H h0 = M::corner(f, 0), h1 = M::corner(f, 1), h2 = M::corner(f, 2);
  const typename M::V a = mesh.origin[h0], b = mesh.origin[h1], c = mesh.origin[h2];
  const H t1 = mesh.twin[h1], t2 = mesh.twin[h2];
  FaceSplit<M> result;
  result.second = append_face(mesh, b, c, m, mesh.planar[h1], mesh.planar[h2], u);
  result.third = append_face(mesh, c, a, m, mesh.planar[h2], mesh.planar[h0], u);
  const H s0 = M::corner(result.second, 0), s1 = M::corner(result.second, 1), s2 = M::corner(result.second, 2);
  const H r0 = M::corner(result.third, 0), r1 = M::corner(result.third, 1), r2 = M::corner(result.third, 2);
  link(mesh, s0, t1);
  link(mesh, r0, t2);
  link(mesh, h1, s2);
  link(mesh, s1, r2);
  link(mesh, h2, r1);
  mesh.origin.set(h2, m);
  mesh.planar.set(h2, u);
  if (mesh.outgoing[c] == h2) mesh.outgoing.set(c, r0);
  mesh.outgoing.set(m, h2);
  return result;
}

/// Turns the inner edge h = a -> b of the faces a b c and b a d into d -> c. Afterwards: h is a -> d (it was next(g)),
/// next(h) is d -> c, g = the old twin is b -> c (it was next(h)), next(g) is c -> d. Payload of next(g) moves to h, of
/// next(h) to g.
template <class M>
void flip_edge_topology(M& mesh, typename M::H h) {
  using H = typename M::H;
  const H g = mesh.twin[h], hn = M::next(h), hp = M::prev(h), gn = M::next(g), gp = M::prev(g);
  const typename M::V a = mesh.origin[h], b = mesh.origin[g], c = mesh.origin[hp], d = mesh.origin[gp];
  const Vec2 uc = mesh.planar[hp], ud = mesh.planar[gp];
  const H outer_h = mesh.twin[gn], outer_g = mesh.twin[hn];
  link(mesh, h, outer_h);
  link(mesh, g, outer_g);
  if (!outer_h.valid()) mesh.twin.set(h, H{});
  if (!outer_g.valid()) mesh.twin.set(g, H{});
  mesh.origin.set(hn, d);
  mesh.planar.set(hn, ud);
  mesh.origin.set(gn, c);
  mesh.planar.set(gn, uc);
  link(mesh, hn, gn);
  if (mesh.outgoing[a] == gn) mesh.outgoing.set(a, h);
  if (mesh.outgoing[b] == hn) mesh.outgoing.set(b, g);
}

}  // namespace kerf::cut
