// The simulation mesh: box cells of a regular lattice, one copy of a cell per connected piece of material in it
// (4.2.1). Everything a cut changes is journaled; ids are stable and never reused.
//
// Material near a collision triangle is its prism (prism.h). The part of a prism in one cell is a *piece*; a copy is a
// class of pieces that hang together inside the cell. Nodes belong to lattice corners; copies in neighbouring cells share
// nodes where material passes through their common face. Copies with hardly any material are absorbed: they
// are no elements, their material and points belong to their host.
//
// At the tip of a slit a cell may be split although the material ahead of the tip still hangs together: pieces ahead of the tip
// then come in two, left and right of the tip's continuation, and tip_glue.h ties the nodes together.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>

#include "kerf/base/journal.h"
#include "kerf/lattice/lattice_frame.h"
#include "kerf/lattice/prism.h"

namespace kerf {

struct PieceTag;
struct LatticePoolTag;
struct FaceTag;
struct TipTag;
using PieceIndex = Id<PieceTag>;              ///< position in the pool of pieces
using LatticePoolIndex = Id<LatticePoolTag>;  ///< position in a pool of members or links
using LatticeFaceId = Id<FaceTag>;            ///< 3 cell + axis: the face between a cell and the next along an axis
using TipId = Id<TipTag>;

/// Consecutive items of a pool with room to grow in place.
struct LatticeRun {
  std::int32_t first = 0, count = 0, capacity = 0;
};

enum class HexState : std::uint8_t {
  kDead,      ///< replaced by other copies; its id is not used again
  kAbsorbed,  ///< too little material to be an element; see host
  kAlive,     ///< an element
};

struct HexMaterial {
  double fill = 0;         ///< share of the cell inside the copy's prisms: what absorption and `full` go by
  double volume = 0;       ///< m^3 of its own material, scaled to the body's volume: stiffness
  double mass_volume = 0;  ///< m^3 of its own and all absorbed material: mass. 0 for an absorbed copy
  bool full = false;       ///< the prisms fill the cell: the shared element matrix, times volume / cell volume, serves
  std::int32_t body = 0;   ///< of HexMesh::bodies
};

/// The part of a prism in a cell.
struct Piece {
  CellId cell;
  HexId copy;
  TipId tip;                 ///< valid: only the part on one side of this tip's continuation
  std::int32_t side = 0;     ///< then +1 left, -1 right; else 0
  double volume = 0;         ///< in cells, geometric
  bool has_moments = false;  ///< piece_moments holds its moments (else nobody needed them yet)
};

/// A tip of a slit in one cell that its line through the thickness passes.
struct TipCell {
  CollisionVertex vertex;
  CellId cell;
  TipId next_of_vertex, next_in_cell;
  bool active = false;
  double passed = 0;              ///< share of the cell that the slit has passed, 0 to 1
  Vec3 point, direction;          ///< lattice coordinates: the tip, and where the slit would run on
  Vec3 normal;                    ///< of the plane of the continuation, unit in lattice coordinates, points left
  CollisionTriangle left, right;  ///< the triangles on both sides just ahead of the tip (the same one if it is split)
  std::array<CollisionHalfEdge, 4> along;  ///< edges that the continuation runs along: not joined in this cell
};

/// A link between a copy and a copy in the next cell along an axis: they share the face's four nodes.
using HexLink = std::array<HexId, 2>;

/// What the lattice remembers of a collision triangle, to see whether a cut changed its shape.
struct PrismShape {
  std::uint64_t hash = 0;
  std::array<Vec2, 3> planar;  ///< corners in the root plane
  double scale = 1;            ///< ruled volume over the volume of the pieces
};

/// One of the bodies: the root triangles from `first` on, up to the next body's, and its cells.
struct LatticeBody {
  RootId first;
  double volume = 0;              ///< m^3 at rest
  double scale = 1;               ///< its volume over that of its prisms
  LatticeFrame frame;             ///< HexMesh lays the indices of the bodies' cells side by side
  CellId first_cell;              ///< the numbers of its cells follow each other from here on
  std::int32_t first_corner = 0;  ///< those of its corners
};

struct HexMesh {
  std::vector<LatticeBody> bodies;  ///< in order; mostly one
  /// The body of a root triangle, and of a cell or a corner.
  [[nodiscard]] std::int32_t body_of(RootId root) const {
    return last_body([root](const LatticeBody& b) { return b.first <= root; });
  }
  [[nodiscard]] std::int32_t body_at(LatticeIndex c) const {
    return last_body([&c](const LatticeBody& b) { return b.frame.first[0] <= c[0]; });
  }
  [[nodiscard]] const LatticeFrame& frame_of_body(std::int32_t body) const {
    return bodies[static_cast<std::size_t>(body)].frame;
  }
  [[nodiscard]] const LatticeFrame& frame_at(LatticeIndex c) const { return frame_of_body(body_at(c)); }
  [[nodiscard]] const LatticeFrame& frame_of(HexId h) const { return frame_at(cell[h]); }
  [[nodiscard]] const LatticeFrame& frame_of(RootId root) const { return frame_of_body(body_of(root)); }
  [[nodiscard]] bool contains(LatticeIndex c) const { return frame_at(c).contains(c); }
  [[nodiscard]] CellId cell_id(LatticeIndex c) const {
    const LatticeBody& b = bodies[static_cast<std::size_t>(body_at(c))];
    return CellId(b.first_cell.value + b.frame.cell_number(c));
  }
  [[nodiscard]] LatticeIndex index_of(CellId c) const {
    const LatticeBody& b =
        bodies[static_cast<std::size_t>(last_body([c](const LatticeBody& other) { return other.first_cell <= c; }))];
    return b.frame.cell_at(c.value - b.first_cell.value);
  }
  [[nodiscard]] std::int32_t corner_number(LatticeIndex q) const {
    const LatticeBody& b = bodies[static_cast<std::size_t>(body_at(q))];
    return b.first_corner + b.frame.corner_number(q);
  }
  [[nodiscard]] LatticeIndex corner_of(std::int32_t number) const {
    const LatticeBody& b = bodies[static_cast<std::size_t>(
        last_body([number](const LatticeBody& other) { return other.first_corner <= number; }))];
    return b.frame.corner_at(number - b.first_corner);
  }
  [[nodiscard]] std::size_t cell_count() const {
    return bodies.empty() ? 0 : bodies.back().first_cell.index() + bodies.back().frame.cell_count();
  }
  /// The last body with a property that bodies have up to it, or the first.
  template <class Has>
  [[nodiscard]] std::int32_t last_body(Has has) const {
    std::size_t body = 0;
    while (body + 1 < bodies.size() && has(bodies[body + 1])) ++body;
    return static_cast<std::int32_t>(body);
  }

  // per copy
  Journaled<HexId, LatticeIndex> cell;
  Journaled<HexId, std::array<NodeId, 8>> nodes;  ///< corner order as in lattice_frame.h
  Journaled<HexId, HexState> state;
  Journaled<HexId, HexId> host;    ///< itself, or the living copy that holds its material and points; dead: none
  Journaled<HexId, HexId> parent;  ///< the copy of the same cell that it was split off from, or none
  Journaled<HexId, HexMaterial> material;
  Journaled<HexId, std::array<double, 27>>
      weights;  ///< of quadrature_points(), as shares of the cell volume; own material
  Journaled<HexId, HexId> next_in_cell;
  Journaled<HexId, HexId> absorber;  ///< whom it was given to; host is the end of this chain
  Journaled<HexId, HexId> first_guest, next_guest;
  Journaled<HexId, std::array<std::int32_t, 2>>
      first_piece;  ///< (triangle, side) of its first piece: orders equal fills
  Journaled<HexId, std::int32_t> piece_count;
  // per node
  Journaled<NodeId, LatticeIndex> corner;
  Journaled<NodeId, NodeId> node_parent;      ///< the node that it was split off from, or none
  Journaled<NodeId, std::int32_t> node_uses;  ///< living copies that use it; 0: not a freedom
  // per cell
  Journaled<CellId, HexId> first_copy;
  Journaled<CellId, LatticeRun> members;  ///< the triangles whose prisms are in the cell, ascending, in member_pool
  Journaled<CellId, TipId> first_tip;
  Journaled<LatticePoolIndex, CollisionTriangle> member_pool;
  // per face of the lattice
  Journaled<LatticeFaceId, LatticeRun> links;
  Journaled<LatticePoolIndex, HexLink> link_pool;
  // per collision triangle
  Journaled<CollisionTriangle, LatticeRun> pieces;  ///< by (cell, side), in piece_pool
  Journaled<PieceIndex, Piece> piece_pool;
  Journaled<PieceIndex, Moments> piece_moments;  ///< in parallel
  Journaled<CollisionTriangle, PrismShape> shape;
  // per collision vertex
  Journaled<CollisionVertex, PrismCorners> prism_corner;
  Journaled<CollisionVertex, TipId> vertex_tip;
  Journaled<TipId, TipCell> tips;

  // Copies and moves are compiled once, in hex_mesh.cpp.
  HexMesh();
  HexMesh(const HexMesh&);
  HexMesh(HexMesh&&) noexcept;
  HexMesh& operator=(const HexMesh&);
  HexMesh& operator=(HexMesh&&) noexcept;
  ~HexMesh();

  template <class Fn>
  void for_each_array(Fn&& f) {
    f(cell);
    f(nodes);
    f(state);
    f(host);
    f(parent);
    f(material);
    f(weights);
    f(next_in_cell);
    f(absorber);
    f(first_guest);
    f(next_guest);
    f(first_piece);
    f(piece_count);
    f(corner);
    f(node_parent);
    f(node_uses);
    f(first_copy);
    f(members);
    f(first_tip);
    f(member_pool);
    f(links);
    f(link_pool);
    f(pieces);
    f(piece_pool);
    f(piece_moments);
    f(shape);
    f(prism_corner);
    f(vertex_tip);
    f(tips);
  }

  [[nodiscard]] std::size_t hex_count() const { return cell.size(); }     ///< ids, dead ones included
  [[nodiscard]] std::size_t node_count() const { return corner.size(); }  ///< ids, unused ones included
  [[nodiscard]] bool alive(HexId h) const { return state[h] == HexState::kAlive; }
  [[nodiscard]] bool active(NodeId n) const { return node_uses[n] > 0; }
  /// Rest position of a node, metres.
  [[nodiscard]] Vec3 rest(NodeId n) const {
    const LatticeIndex c = corner[n];
    return frame_at(c).to_world({static_cast<double>(c[0]), static_cast<double>(c[1]), static_cast<double>(c[2])});
  }
  /// A point at rest in the coordinates of a copy's cell, -1 to 1 inside.
  [[nodiscard]] Vec3 local(HexId h, Vec3 rest_point) const {
    const LatticeIndex c = cell[h];
    const Vec3 q = frame_at(c).to_lattice(rest_point);
    return {2 * (q.x - c[0]) - 1, 2 * (q.y - c[1]) - 1, 2 * (q.z - c[2]) - 1};
  }
  [[nodiscard]] std::span<const Piece> pieces_of(CollisionTriangle t) const {
    const LatticeRun r = pieces[t];
    return piece_pool.slice(static_cast<std::size_t>(r.first), static_cast<std::size_t>(r.count));
  }
  [[nodiscard]] std::span<const CollisionTriangle> members_of(CellId c) const {
    const LatticeRun r = members[c];
    return member_pool.slice(static_cast<std::size_t>(r.first), static_cast<std::size_t>(r.count));
  }
  [[nodiscard]] std::span<const HexLink> links_of(LatticeFaceId f) const {
    const LatticeRun r = links[f];
    return link_pool.slice(static_cast<std::size_t>(r.first), static_cast<std::size_t>(r.count));
  }
  static constexpr LatticeFaceId face(CellId c, int axis) { return LatticeFaceId(3 * c.value + axis); }
};

/// The cells of the body that a collision vertex is of, and the corners of its prism among them.
const LatticeFrame& frame_around(const CollisionMesh& mesh, const HexMesh& hex, CollisionVertex v);
PrismCorners corners_of(const CollisionMesh& mesh, const HexMesh& hex, CollisionVertex v);

/// Of all bodies: the size of the largest cell, by volume, and the shortest edge of a cell, metres.
Vec3 largest_cell(const HexMesh& hex);
double shortest_cell_edge(const HexMesh& hex);

/// Number of living copies and of the nodes that they use.
std::size_t count_alive(const HexMesh& hex);
std::size_t count_active_nodes(const HexMesh& hex);

/// Local coordinates of the 27 points that HexMesh::weights belong to: 3 x 3 x 3 Gauss-Legendre, x fastest.
const std::array<Vec3, 27>& quadrature_points();
/// Their weights for a full cell, as shares of the cell's volume (they add up to 1).
const std::array<double, 27>& full_weights();
/// The weights at quadrature_points() that have the given moments: they integrate every polynomial of degree 2 along
/// each axis over the material exactly (so every product of two strains of the element), and may be negative.
std::array<double, 27> weights_of(const Moments& moments);

}  // namespace kerf
