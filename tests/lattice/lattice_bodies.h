// Small bodies and cuts for the tests of lattice and embedding: grids, bent and jittered, cut along edges.
#pragma once

#include <cmath>
#include <functional>
#include <vector>

#include "kerf/base/random.h"
#include "kerf/binding/collision_mesh_build.h"

namespace kerf {

/// nx x ny quads over [0, lx] x [0, ly], two triangles each, moved by `place`.
inline CollisionMesh grid_body(int nx, int ny, double lx, double ly, double thickness,
                               const std::function<Vec3(Vec3)>& place = {}) {
  TriangleMesh surface;
  for (int j = 0; j <= ny; ++j)
    for (int i = 0; i <= nx; ++i) {
      const Vec3 p{lx * i / nx, ly * j / ny, 0};
      surface.positions.push_back(place ? place(p) : p);
    }
  auto id = [&](int i, int j) { return VertexId(j * (nx + 1) + i); };
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      if ((i + j) % 2 == 0) {
        surface.triangles.push_back({id(i, j), id(i + 1, j), id(i + 1, j + 1)});
        surface.triangles.push_back({id(i, j), id(i + 1, j + 1), id(i, j + 1)});
      } else {
        surface.triangles.push_back({id(i, j), id(i + 1, j), id(i, j + 1)});
        surface.triangles.push_back({id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)});
      }
    }
  const std::vector<double> half(surface.positions.size(), 0.5 * thickness);
  auto mesh = build_collision_mesh(surface, half);
  return std::move(mesh).value();
}

/// Cuts one edge: its two triangles let go of each other, and an end that was on a border before falls apart; the part on
/// the side of h's twin gets a new vertex. Returns the triangles that changed.
inline void unlink_edge(CollisionMesh& mesh, CollisionHalfEdge h, std::vector<CollisionTriangle>& changed) {
  const CollisionHalfEdge g = mesh.twin[h];
  const CollisionVertex ends[2] = {mesh.from(h), mesh.to(h)};
  const bool split[2] = {mesh.on_border(ends[0]), mesh.on_border(ends[1])};
  mesh.twin.set(h, {});
  mesh.twin.set(g, {});
  changed.push_back(CollisionMesh::face(h));
  changed.push_back(CollisionMesh::face(g));
  for (int e = 0; e < 2; ++e) {
    const CollisionVertex v = ends[e];
    const CollisionHalfEdge left = e == 0 ? h : CollisionMesh::next(h), right = e == 0 ? CollisionMesh::next(g) : g;
    mesh.outgoing.set(v, left);
    if (!split[e]) continue;
    const CollisionVertex w = mesh.outgoing.push_back(right);
    mesh.rest.push_back(mesh.rest[v]);
    mesh.offset.push_back(mesh.offset[v]);
    mesh.bound.push_back(mesh.bound[v]);
    mesh.line.push_back(mesh.line[v]);
    mesh.ancestor.push_back(mesh.ancestor[v]);
    std::vector<CollisionHalfEdge> fan;
    mesh.for_each_outgoing(w, [&](CollisionHalfEdge o) {
      fan.push_back(o);
      return true;
    });
    for (const CollisionHalfEdge o : fan) {
      mesh.origin.set(o, w);
      changed.push_back(CollisionMesh::face(o));
    }
  }
}

/// Splits edge h at the fraction t of its length; keeps the ids of both faces for the parts at from(h).
inline CollisionVertex split_edge(CollisionMesh& mesh, CollisionHalfEdge h, double t,
                                  std::vector<CollisionTriangle>& changed) {
  using M = CollisionMesh;
  const CollisionVertex a = mesh.from(h), b = mesh.to(h);
  const CollisionHalfEdge g = mesh.twin[h];
  const CollisionVertex m = mesh.outgoing.push_back({});
  mesh.rest.push_back(lerp(mesh.rest[a], mesh.rest[b], t));
  mesh.offset.push_back(lerp(mesh.offset[a], mesh.offset[b], t));
  mesh.bound.push_back({});
  mesh.line.push_back({});
  mesh.ancestor.push_back(m);
  auto add_face = [&](M::F like, std::array<CollisionVertex, 3> v, std::array<Vec2, 3> planar) {
    for (std::size_t i = 0; i < 3; ++i) {
      mesh.origin.push_back(v[i]);
      mesh.twin.push_back({});
      mesh.planar.push_back(planar[i]);
      mesh.chain.push_back({});
      mesh.wall.push_back({});
    }
    mesh.free.push_back({});
    changed.push_back(like);
    return mesh.root.push_back(mesh.root[like]);
  };
  auto link = [&](CollisionHalfEdge x, CollisionHalfEdge y) {
    mesh.twin.set(x, y);
    if (y.valid()) mesh.twin.set(y, x);
  };
  // Left face (a, b, c) becomes (a, m, c) and (m, b, c).
  const CollisionHalfEdge bc = M::next(h), ca = M::prev(h);
  const CollisionVertex c = mesh.from(ca);
  const Vec2 left = lerp(mesh.planar[h], mesh.planar[bc], t);
  const M::F f = add_face(M::face(h), {m, b, c}, {left, mesh.planar[bc], mesh.planar[ca]});
  changed.push_back(f);
  const CollisionHalfEdge mb = M::corner(f, 0), outer = mesh.twin[bc];
  link(M::corner(f, 1), outer);
  if (!outer.valid()) mesh.twin.set(M::corner(f, 1), {});
  if (outer.valid()) changed.push_back(M::face(outer));
  mesh.origin.set(bc, m);
  mesh.planar.set(bc, left);
  link(bc, M::corner(f, 2));  // m -> c of the kept face, c -> m of the new one
  CollisionHalfEdge bm;
  if (g.valid()) {  // right face (b, a, d) becomes (m, a, d) and (b, m, d)
    const CollisionHalfEdge ad = M::next(g), db = M::prev(g);
    const CollisionVertex d = mesh.from(db);
    const Vec2 right = lerp(mesh.planar[ad], mesh.planar[g], t);
    const M::F k = add_face(M::face(g), {b, m, d}, {mesh.planar[g], right, mesh.planar[db]});
    changed.push_back(k);
    bm = M::corner(k, 0);
    const CollisionHalfEdge beyond = mesh.twin[db];
    link(M::corner(k, 2), beyond);
    if (beyond.valid()) changed.push_back(M::face(beyond));
    mesh.origin.set(g, m);
    mesh.planar.set(g, right);
    link(db, M::corner(k, 1));  // d -> m of the kept face, m -> d of the new one
    mesh.outgoing.set(m, g);
    link(h, g);
    link(mb, bm);
  } else {
    mesh.twin.set(mb, {});
    mesh.outgoing.set(m, mb);
  }
  if (mesh.outgoing[b] == g || CollisionMesh::face(mesh.outgoing[b]) != f) mesh.outgoing.set(b, M::corner(f, 1));
  if (!g.valid()) mesh.outgoing.set(m, mb);
  return m;
}

/// Splits triangle f at barycentric coordinates w; f keeps its first edge.
inline CollisionVertex split_face(CollisionMesh& mesh, CollisionTriangle f, std::array<double, 3> w,
                                  std::vector<CollisionTriangle>& changed) {
  using M = CollisionMesh;
  std::array<CollisionHalfEdge, 3> h{M::corner(f, 0), M::corner(f, 1), M::corner(f, 2)};
  std::array<CollisionVertex, 3> v;
  std::array<Vec2, 3> planar;
  Vec3 rest{}, offset{};
  Vec2 flat{};
  for (std::size_t i = 0; i < 3; ++i) {
    v[i] = mesh.origin[h[i]];
    planar[i] = mesh.planar[h[i]];
    rest += w[i] * mesh.rest[v[i]];
    offset += w[i] * mesh.offset[v[i]];
    flat = flat + w[i] * planar[i];
  }
  const CollisionVertex m = mesh.outgoing.push_back({});
  mesh.rest.push_back(rest);
  mesh.offset.push_back(offset);
  mesh.bound.push_back({});
  mesh.line.push_back({});
  mesh.ancestor.push_back(m);
  CollisionTriangle part[3] = {f, {}, {}};
  for (std::size_t i = 1; i < 3; ++i) {
    const std::array<CollisionVertex, 3> corner{v[i], v[(i + 1) % 3], m};
    const std::array<Vec2, 3> at{planar[i], planar[(i + 1) % 3], flat};
    for (std::size_t k = 0; k < 3; ++k) {
      mesh.origin.push_back(corner[k]);
      mesh.twin.push_back({});
      mesh.planar.push_back(at[k]);
      mesh.chain.push_back({});
      mesh.wall.push_back({});
    }
    mesh.free.push_back({});
    part[i] = mesh.root.push_back(mesh.root[f]);
    const CollisionHalfEdge outer = mesh.twin[h[i]];
    mesh.twin.set(M::corner(part[i], 0), outer);
    if (outer.valid()) {
      mesh.twin.set(outer, M::corner(part[i], 0));
      changed.push_back(M::face(outer));
    }
    changed.push_back(part[i]);
  }
  mesh.origin.set(h[2], m);
  mesh.planar.set(h[2], flat);
  for (int i = 0; i < 3; ++i) {  // edge corner[i+1] -> m of part i is m -> corner of part i+1
    const CollisionHalfEdge a = M::corner(part[i], 1), b = M::corner(part[(i + 1) % 3], 2);
    mesh.twin.set(a, b);
    mesh.twin.set(b, a);
  }
  mesh.outgoing.set(m, h[2]);
  mesh.outgoing.set(v[2], M::corner(part[2], 0));
  mesh.outgoing.set(v[1], M::corner(part[1], 0));
  changed.push_back(f);
  return m;
}

/// Cuts along edges from a random vertex in a random direction, at most `steps` edges; may start and end anywhere.
inline void random_walk_cut(CollisionMesh& mesh, Random& random, int steps, std::vector<CollisionTriangle>& changed) {
  CollisionVertex v(random.index(static_cast<int>(mesh.vertex_count())));
  Vec3 direction{};
  for (int s = 0; s < steps; ++s) {
    CollisionHalfEdge best;
    double most = -2;
    std::vector<CollisionHalfEdge> fan;
    mesh.for_each_outgoing(v, [&](CollisionHalfEdge h) {
      fan.push_back(h);
      return true;
    });
    for (const CollisionHalfEdge h : fan) {
      if (mesh.is_border(h)) continue;
      const double along = dot(normalized(mesh.rest[mesh.to(h)] - mesh.rest[v]), direction) + 0.7 * random.uniform();
      if (along > most) most = along, best = h;
    }
    if (!best.valid() || (s > 0 && most < 0)) return;
    const CollisionVertex next = mesh.to(best);
    direction = normalized(mesh.rest[next] - mesh.rest[v]);
    const bool ends = mesh.on_border(next);
    unlink_edge(mesh, best, changed);
    if (ends) return;
    v = next;
  }
}

/// A cut that splits triangles: from edge to edge through random triangles, starting in a triangle (a stab), ending
/// anywhere. Fractions stay between 0.1 and 0.9.
inline void random_splitting_cut(CollisionMesh& mesh, Random& random, int steps,
                                 std::vector<CollisionTriangle>& changed) {
  using M = CollisionMesh;
  CollisionTriangle f(random.index(static_cast<int>(mesh.face_count())));
  CollisionVertex from = split_face(mesh, f, {0.3, 0.3, 0.4}, changed);
  Vec3 direction = normalized(mesh.rest[mesh.to(mesh.outgoing[from])] - mesh.rest[from]);
  for (int s = 0; s < steps; ++s) {
    CollisionHalfEdge best;
    double most = 0;
    std::vector<CollisionHalfEdge> fan;
    mesh.for_each_outgoing(from, [&](CollisionHalfEdge h) {
      fan.push_back(h);
      return true;
    });
    for (const CollisionHalfEdge h : fan) {
      const Vec3 opposite = 0.5 * (mesh.rest[mesh.to(h)] + mesh.rest[mesh.apex(h)]);
      const double along = dot(normalized(opposite - mesh.rest[from]), direction);
      if (along > most) most = along, best = M::next(h);
    }
    if (!best.valid()) return;
    const bool rim = mesh.is_border(best);
    CollisionVertex to;
    if (s + 1 == steps && !rim) {
      to = split_face(mesh, M::face(best), {0.35, 0.35, 0.3}, changed);  // the tip stays inside
    } else {
      to = split_edge(mesh, best, random.uniform(0.1, 0.9), changed);
    }
    const CollisionHalfEdge path = mesh.find_half_edge(from, to);
    if (!path.valid() || mesh.is_border(path)) return;
    direction = normalized(mesh.rest[to] - mesh.rest[from]);
    unlink_edge(mesh, path, changed);
    if (rim) return;
    from = to;
  }
}

}  // namespace kerf
