#include "kerf/contact/contact_surface.h"

#include <algorithm>
#include <cmath>

#include "kerf/base/hash.h"
#include "kerf/contact/rest_neighbours.h"

namespace kerf {
namespace {

using V = ContactSurface::V;
using H = ContactSurface::H;
using F = ContactSurface::F;

/// A border counts as original if it lies on an original one, to this part of its length.
constexpr double kOnBorder = 1e-6;

bool on_line(Vec3 p, Vec3 a, Vec3 b) {
  const Vec3 d = b - a;
  return norm(cross(p - a, d)) <= kOnBorder * dot(d, d);
}

bool is_cut(const CollisionMesh& mesh, const ContactSurface& s, H h) {
  if (mesh.twin[h].valid()) return false;
  if (mesh.wall[h].valid()) return true;
  const auto bound = mesh.bound[mesh.from(h)];
  if (bound[1].valid()) return false;  // a closed body: a border without a wall is the rim
  const RootId r = mesh.root[CollisionMesh::face(h)];
  const Vec3 a = mesh.rest[mesh.from(h)], b = mesh.rest[mesh.to(h)];
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 p = s.root_corner[r][i], q = s.root_corner[r][(i + 1) % 3];
    if ((s.root_border[r] >> i & 1) != 0 && on_line(a, p, q) && on_line(b, p, q)) return false;
  }
  return true;
}

/// Cuts interpolate: what they raise a radius by is rounding, and must not tell a body with a cut that was taken back from one that never had it.
double rounded(double radius) { return static_cast<double>(static_cast<float>(radius)); }

double circumradius(Vec3 a, Vec3 b, Vec3 c) {
  const double area = norm(cross(b - a, c - a));  // twice
  return area > 0 ? norm(b - a) * norm(c - b) * norm(a - c) / (2 * area) : HUGE_VAL;
}

void unlist(ContactSurface& s, F f) {
  SurfaceTree& tree = s.tree;
  ++s.node_changes[s.root_leaf[s.root[f]]];
  F* link = &tree.first[s.root[f]];
  while (link->valid() && *link != f) link = &tree.next[*link];
  if (link->valid()) *link = tree.next[f];
}
void enlist(ContactSurface& s, F f) {  // newest first
  SurfaceTree& tree = s.tree;
  F* link = &tree.first[s.root[f]];
  while (link->valid() && *link > f) link = &tree.next[*link];
  tree.next[f] = *link;
  *link = f;
}

void copy_vertex(const CollisionMesh& mesh, ContactSurface& s, V v) {
  s.outgoing[v] = mesh.outgoing[v];
  s.rest[v] = mesh.rest[v];
  s.offset[v] = mesh.offset[v];
  s.radius[v] = norm(mesh.offset[v]);
}

void find_on_cut(const CollisionMesh& mesh, ContactSurface& s, V v) {
  std::uint8_t on = 0;
  mesh.for_each_outgoing(v, [&](H h) {
    if (s.cut[h] != 0 || s.cut[ContactSurface::prev(h)] != 0) on = 1;
    return true;
  });
  s.on_cut[v] = on;
}

void copy_face(const CollisionMesh& mesh, ContactSurface& s, F f) {
  for (int i = 0; i < 3; ++i) {
    const H h = ContactSurface::corner(f, i);
    s.origin[h] = mesh.origin[h];
    s.twin[h] = mesh.twin[h];
    s.cut[h] = is_cut(mesh, s, h) ? 1 : 0;
  }
  const auto v = s.vertices(f);
  for (const V corner : v) copy_vertex(mesh, s, corner);
  const double r = std::min({s.radius[v[0]], s.radius[v[1]], s.radius[v[2]]});
  s.coarse[f] = circumradius(s.rest[v[0]], s.rest[v[1]], s.rest[v[2]]) > kCoarse * r ? 1 : 0;
}

/// Its cut edges near the tree's nodes, in (+1) or out (-1).
void count_cut_edges(ContactSurface& s, F f, int change) {
  for (int i = 0; i < 3; ++i)
    if (const H h = ContactSurface::corner(f, i); s.cut[h] != 0)
      count_cut_edge(s, s.rest[s.from(h)], s.rest[s.to(h)], change);
}

/// Different for different bodies: what detection remembers of one is never taken for another.
std::uint32_t fingerprint(const CollisionMesh& mesh) {
  Hash hash;
  hash.add(mesh.rest.raw());
  hash.add(mesh.offset.raw());
  hash.add(mesh.origin.raw());
  hash.add(mesh.twin.raw());
  return static_cast<std::uint32_t>(hash.value() ^ hash.value() >> 32);
}

void resize(ContactSurface& s, std::size_t vertices, std::size_t faces) {
  s.origin.resize(3 * faces);
  s.twin.resize(3 * faces);
  s.cut.resize(3 * faces);
  s.root.resize(faces);
  s.coarse.resize(faces);
  s.tree.next.resize(faces);
  s.outgoing.resize(vertices);
  s.rest.resize(vertices);
  s.offset.resize(vertices);
  s.radius.resize(vertices);
  s.on_cut.resize(vertices);
}

}  // namespace

ContactSurface make_contact_surface(const CollisionMesh& mesh) {
  ContactSurface s;
  std::size_t roots = 0;
  for (const RootId r : mesh.root.raw()) roots = std::max(roots, r.index() + 1);
  s.root_corner.resize(roots);
  s.root_border.resize(roots);
  std::vector<Box3> boxes(roots);
  std::vector<int> pieces(roots, 0);
  for (const F f : ids<F>(mesh.face_count())) {
    const RootId r = mesh.root[f];
    ++pieces[r.index()];
    for (int i = 0; i < 3; ++i) {
      const H h = CollisionMesh::corner(f, i);
      s.root_corner[r][static_cast<std::size_t>(i)] = mesh.rest[mesh.from(h)];
      if (!mesh.twin[h].valid()) s.root_border[r] = static_cast<std::uint8_t>(s.root_border[r] | 1 << i);
      boxes[r.index()].add(mesh.rest[mesh.from(h)]);
    }
  }
  Box3 all;
  for (const Vec3 p : mesh.rest.raw()) all.add(p);
  s.size = all.diagonal();
  for (std::size_t r = 0; r < roots; ++r)
    if (pieces[r] != 1) s.root_border[RootId(r)] = 0;  // cut already: nobody knows what its border was
  s.tree = make_surface_tree(boxes);
  s.node_open.assign(s.tree.nodes.size(), 0);
  s.node_changes.assign(s.tree.nodes.size(), fingerprint(mesh));
  s.root_leaf.resize(roots);
  for (std::uint32_t n = 0; n < s.tree.nodes.size(); ++n)
    for (std::uint32_t i = 0; i < s.tree.nodes[n].count; ++i) s.root_leaf[s.tree.roots[s.tree.nodes[n].first + i]] = n;
  rebuild_contact_surface(mesh, s);
  make_rest_culling(s);
  for (const F f : ids<F>(s.face_count())) count_cut_edges(s, f, 1);
  return s;
}

void rebuild_contact_surface(const CollisionMesh& mesh, ContactSurface& s) {
  for (const F f : ids<F>(s.face_count())) count_cut_edges(s, f, -1);
  resize(s, 0, 0);
  s.tree.first = IndexedArray<RootId, F>(s.root_corner.size());
  for (std::uint32_t& changes : s.node_changes) ++changes;
  update_contact_surface(mesh, {}, s);
}

void update_contact_surface(const CollisionMesh& mesh, std::span<const F> changed, ContactSurface& s) {
  const std::size_t old_faces = s.face_count(), faces = mesh.face_count(), kept = std::min(old_faces, faces);
  const std::size_t old_vertices = s.vertex_count();
  for (std::size_t f = old_faces; f-- > kept;) {
    unlist(s, F(f));
    count_cut_edges(s, F(f), -1);
  }
  for (const F f : changed)
    if (f.index() < kept) count_cut_edges(s, f, -1);
  // Vertices that a triangle loses have another outgoing half-edge afterwards.
  std::vector<V> vertices;
  for (const F f : changed)
    if (f.index() < kept)
      for (const V v : s.vertices(f)) vertices.push_back(v);
  for (std::size_t f = kept; f < old_faces; ++f)
    for (const V v : s.vertices(F(f))) vertices.push_back(v);
  resize(s, mesh.vertex_count(), faces);
  const auto renew = [&](F f) {
    copy_face(mesh, s, f);
    ++s.node_changes[s.root_leaf[s.root[f]]];
    count_cut_edges(s, f, 1);
    for (const V v : s.vertices(f)) vertices.push_back(v);
  };
  for (const F f : changed) {
    if (f.index() >= kept) continue;
    if (s.root[f] != mesh.root[f]) {  // rolled back and taken anew since the last time
      unlist(s, f);
      s.root[f] = mesh.root[f];
      enlist(s, f);
    }
    renew(f);
  }
  for (std::size_t f = kept; f < faces; ++f) {
    s.root[F(f)] = mesh.root[F(f)];
    enlist(s, F(f));
    renew(F(f));
  }
  for (std::size_t v = old_vertices; v < mesh.vertex_count(); ++v) vertices.push_back(V(v));
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  for (const V v : vertices) {
    if (v.index() >= mesh.vertex_count()) continue;
    copy_vertex(mesh, s, v);
    find_on_cut(mesh, s, v);
    s.largest_radius = std::max(s.largest_radius, rounded(s.radius[v]));
  }
}

}  // namespace kerf
