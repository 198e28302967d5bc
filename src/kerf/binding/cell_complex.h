// The cell complex: collision mesh and visual mesh of one body, and who owns what. Pre-processing (4.1) makes it,
// cutting (4.2) changes it, and after every operation the following table is true:
//
//   collision element                        owns on the visual mesh
//   vertex, inner                            bound[+] and bound[-]
//   vertex on the original rim               bound[+] == bound[-]: one visual vertex
//   vertex on a border made by a cut         bound[+], bound[-] and the line of vertices between them
//   edge of the original mesh, or cut edge   a + and a - chain of visual edges (the same one on the rim)
//   any other inner edge                     nothing: visual triangles may straddle it
//   triangle                                 the free visual vertices whose planar image lies in it, per side
//   border edge made by a cut                its chains and the wall: the strip of cut surface between them
//
// A visual mesh that is an open sheet has the + side only: every chain[-], bound[-] and free[-] is none, on the rim
// too, and there are no lines and no walls.
//
// Planes. Each root triangle (a collision triangle of the pre-processing) has a plane with 2D coordinates, isometric
// to the triangle at rest; its corners keep these coordinates for ever, and so do all points in it ("parameters
// without drift"). `planar` of a collision corner and of a visual corner on the + side are positions in that plane;
// on the - side y is mirrored (-y), so that every visual patch is positively oriented. All corners of one vertex in
// one plane hold the same bits, and a bound visual vertex holds the same bits as its collision vertex (up to the
// mirror). A wall is a patch with a plane of its own: (column index, -layer).
#pragma once

#include <array>
#include <cstdint>

#include "kerf/mesh/half_edge.h"

namespace kerf {

enum class Side : std::uint8_t { kPlus = 0, kMinus = 1 };
constexpr int index(Side s) { return static_cast<int>(s); }
constexpr Side kSides[2] = {Side::kPlus, Side::kMinus};

struct PoolTag;
using PoolIndex = Id<PoolTag>;  ///< position in a pool of visual vertices

/// Consecutive items of a pool; count < 0 means "there is no such list" (not the same as an empty one).
struct PoolRun {
  std::int32_t first = 0;
  std::int32_t count = -1;
  bool reversed = false;  ///< read from back to front: the same chain seen from the twin half-edge
  [[nodiscard]] bool exists() const { return count >= 0; }
  /// Position in the pool of the i-th item in reading order.
  [[nodiscard]] PoolIndex at(std::int32_t i) const { return PoolIndex(reversed ? first + count - 1 - i : first + i); }
  [[nodiscard]] PoolRun flipped() const { return {first, count, !reversed}; }
  /// Items i .. i+n-1 in reading order.
  [[nodiscard]] PoolRun part(std::int32_t i, std::int32_t n) const {
    return {reversed ? first + count - i - n : first + i, n, reversed};
  }
};

/// What a visual triangle belongs to: one side of a root triangle, or a wall.
struct Patch {
  std::int32_t value = -1;
  static constexpr Patch of_root(RootId r, Side s) { return {2 * r.value + index(s)}; }
  static constexpr Patch of_wall(WallId w) { return {-2 - w.value}; }
  [[nodiscard]] constexpr bool is_wall() const { return value <= -2; }
  [[nodiscard]] constexpr RootId root() const { return RootId(value / 2); }
  [[nodiscard]] constexpr Side side() const { return static_cast<Side>(value & 1); }
  [[nodiscard]] constexpr WallId wall() const { return WallId(-2 - value); }
  friend constexpr bool operator==(Patch, Patch) = default;
};

struct CollisionMesh : HalfEdgeMesh<CollisionTag> {
  // per half-edge
  Journaled<H, std::array<PoolRun, 2>> chain;  ///< inner visual vertices in order, per side; none on chainless edges
  Journaled<H, WallId> wall;                   ///< only border edges made by a cut in a closed body
  // per vertex
  Journaled<V, Vec3> rest;                          ///< metres
  Journaled<V, Vec3> offset;                        ///< rest +- offset are the prism's corners: normal x half thickness
  Journaled<V, std::array<VisualVertex, 2>> bound;  ///< per side; equal on the rim; open sheet: [-] none
  Journaled<V, PoolRun> line;  ///< inner visual vertices from bound[+] to bound[-]; borders made by a cut only
  Journaled<V, V> ancestor;    ///< the vertex it was split off from by a cut (twins share it); itself at birth
  // per triangle
  Journaled<F, RootId> root;
  Journaled<F, std::array<PoolRun, 2>> free;  ///< free visual vertices inside, per side, in any order

  template <class Fn>
  void for_each_array(Fn&& f) {
    for_each_topology_array(f);
    f(chain);
    f(wall);
    f(rest);
    f(offset);
    f(bound);
    f(line);
    f(ancestor);
    f(root);
    f(free);
  }
  [[nodiscard]] bool has_chain(H h) const { return chain[h][0].exists(); }
  /// Is this vertex on the original rim (or on the border of an open sheet)?
  [[nodiscard]] bool on_rim(V v) const { return bound[v][0] == bound[v][1]; }
  /// Is this edge a border that a cut has made?
  [[nodiscard]] bool is_lip(H h) const {
    return is_border(h) && (wall[h].valid() || !on_rim(from(h)) || !on_rim(to(h)));
  }
};

struct VisualMesh : HalfEdgeMesh<VisualTag> {
  // per half-edge
  Journaled<H, Vec2f> texture;         ///< per corner, so that seams and walls need no vertices of their own
  Journaled<H, std::uint8_t> barrier;  ///< 1: the edge lies on a chain, line or border; walks and floods stop here
  // per vertex
  Journaled<V, Vec3> rest;          ///< metres
  Journaled<V, Vec3f> normal;       ///< of the skin at rest, unit; interpolated at new vertices; walls have their own
  Journaled<V, std::uint8_t> free;  ///< 1: not on any chain, border or line; only ever 1 -> 0
  // per face
  Journaled<F, Patch> patch;

  template <class Fn>
  void for_each_array(Fn&& f) {
    for_each_topology_array(f);
    f(texture);
    f(barrier);
    f(rest);
    f(normal);
    f(free);
    f(patch);
  }
};

struct CellComplex {
  CollisionMesh collision;
  VisualMesh visual;
  Journaled<PoolIndex, VisualVertex> chain_pool;   ///< chains and lines
  Journaled<PoolIndex, VisualVertex> free_pool;    ///< free vertices of the triangles
  Journaled<WallId, CollisionHalfEdge> wall_edge;  ///< the border half-edge that a wall hangs on
  Journaled<WallId, PoolRun> wall_inner;  ///< inner visual vertices of the wall (not on chains or lines), any order
  Journaled<PoolIndex, VisualVertex> wall_pool;
  bool closed = false;        ///< the visual mesh has two sides
  double mean_root_edge = 0;  ///< metres; the unit of all cutting tolerances. Of several bodies: the least of theirs

  // Copies and moves are compiled once, in cell_complex.cpp.
  CellComplex();
  CellComplex(const CellComplex&);
  CellComplex(CellComplex&&) noexcept;
  CellComplex& operator=(const CellComplex&);
  CellComplex& operator=(CellComplex&&) noexcept;
  ~CellComplex();

  template <class Fn>
  void for_each_array(Fn&& f) {
    collision.for_each_array(f);
    visual.for_each_array(f);
    f(chain_pool);
    f(free_pool);
    f(wall_edge);
    f(wall_inner);
    f(wall_pool);
  }
};

extern template void journal_mark(CellComplex&, JournalMark&);
extern template void journal_rollback(CellComplex&, const JournalMark&);

}  // namespace kerf
