// The collision geometry of a body: its collision mesh as a prism of varying thickness, with what detection needs to
// know about the rest shape. Everything but the tree over the root triangles follows a cut locally.
//
// The body is the set of points x +- s o, s <= 1, over the mid-surface x with offset o: from a vertex to the + corner of
// its prism. Every vertex and edge has one owner (the face of outgoing(v); the lower half-edge), so that every feature is
// tested once.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kerf/base/indexed.h"
#include "kerf/base/vec.h"
#include "kerf/binding/cell_complex.h"
#include "kerf/contact/surface_tree.h"

namespace kerf {

struct ContactSurface {
  using V = CollisionVertex;
  using H = CollisionHalfEdge;
  using F = CollisionTriangle;

  // Copies of the collision mesh: a cut changes them when update_contact_surface is told, not before.
  IndexedArray<H, V> origin;
  IndexedArray<H, H> twin;
  IndexedArray<V, H> outgoing;
  IndexedArray<V, Vec3> rest;      ///< m
  IndexedArray<V, Vec3> offset;    ///< m, at rest: normal x half thickness
  IndexedArray<V, double> radius;  ///< m, |offset|
  IndexedArray<F, RootId> root;
  // Derived.
  IndexedArray<H, std::uint8_t> cut;     ///< 1: a border made by a cut
  IndexedArray<V, std::uint8_t> on_cut;  ///< 1: an end of such an edge
  IndexedArray<F, std::uint8_t> coarse;  ///< 1: so large against the thickness that its vertices alone miss too much
  SurfaceTree tree;
  std::vector<std::int32_t>
      node_open;  ///< per node: cut edges and other gaps in the surface near it; see rest_neighbours.h
  std::vector<std::uint32_t>
      node_changes;  ///< per leaf: how often triangles in it, or who are neighbours in it, have changed; only grows
  // Of the uncut body, fixed.
  IndexedArray<RootId, std::array<Vec3, 3>> root_corner;
  IndexedArray<RootId, std::uint8_t> root_border;  ///< bit i: edge corner i to i+1 was a border before any cut
  IndexedArray<RootId, std::int32_t> root_piece;   ///< two with different numbers never hung together
  TreeBoxes rest_boxes;                            ///< of the tree, at rest
  IndexedArray<RootId, std::uint32_t> root_leaf;   ///< of the tree
  std::vector<std::int32_t> node_piece;  ///< per node: the piece of the body that it belongs to, or -1: several
  std::vector<float> node_thinnest;      ///< per node: least radius, m; cuts don't lower it
  double largest_radius = 0;             ///< m
  double size = 0;                       ///< diagonal of its box, m

  static constexpr F face(H h) { return CollisionMesh::face(h); }
  static constexpr H corner(F f, int i) { return CollisionMesh::corner(f, i); }
  static constexpr H next(H h) { return CollisionMesh::next(h); }
  static constexpr H prev(H h) { return CollisionMesh::prev(h); }
  [[nodiscard]] std::size_t vertex_count() const { return rest.size(); }
  [[nodiscard]] std::size_t face_count() const { return root.size(); }
  [[nodiscard]] V from(H h) const { return origin[h]; }
  [[nodiscard]] V to(H h) const { return origin[next(h)]; }
  [[nodiscard]] bool owns_vertex(H h) const { return outgoing[origin[h]] == h; }
  [[nodiscard]] bool owns_edge(H h) const { return !twin[h].valid() || h < twin[h]; }
  [[nodiscard]] std::array<V, 3> vertices(F f) const {
    return {origin[corner(f, 0)], origin[corner(f, 1)], origin[corner(f, 2)]};
  }
  /// Is the edge between coarse triangles, or on the border of one?
  [[nodiscard]] bool is_coarse_edge(H h) const {
    return coarse[face(h)] != 0 || (twin[h].valid() && coarse[face(twin[h])] != 0);
  }
  /// Calls visit(h) for every half-edge that leaves v (one per face) until visit returns false: outgoing[v], counter-clockwise those that follow, and
  /// behind a border clockwise the others.
  template <class Visit>
  void for_each_outgoing(V v, Visit&& visit) const {
    const H start = outgoing[v];
    H h = start;
    do {
      if (!visit(h)) return;
      h = twin[prev(h)];
    } while (h.valid() && h != start);
    if (h.valid()) return;
    for (H g = twin[start]; g.valid(); g = twin[g]) {
      g = next(g);
      if (!visit(g)) return;
    }
  }
};

/// Triangles with a circumradius above this part of the thickness' half are coarse: obstacle vertices and edges are tested
/// against their faces and edges too. Below, what the vertices alone miss is under 5 % of the radius.
inline constexpr double kCoarse = 0.3;

/// Prepares an uncut body (borders count as original; walls of an already cut closed body are seen). O(n log n), and for every
/// vertex the faces within a thickness or so.
ContactSurface make_contact_surface(const CollisionMesh& mesh);

/// After a cut, its undo or redo: `changed` are the triangles that are new or changed in any way, no repeats (ids beyond
/// those of the mesh are left out, and all triangles new to the surface are taken anyway). Cost: proportional to them.
void update_contact_surface(const CollisionMesh& mesh, std::span<const CollisionTriangle> changed,
                            ContactSurface& surface);

/// The same from scratch: equal to the surface that was updated cut by cut, to the bit.
void rebuild_contact_surface(const CollisionMesh& mesh, ContactSurface& surface);

}  // namespace kerf
