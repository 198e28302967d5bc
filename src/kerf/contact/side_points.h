// Points of a body's sides and walls besides the corners of its prisms, where the lattice is finer than the collision mesh.
//
//     o-----------------------o     a side between two collision vertices
//     |   x   |   x   |   x   |     cells, and points of the side, each carried by the copy that it lies in
//
// Contact knows a body by its collision vertices. Nodes between them would be free, and the body as soft as they are. Bodies whose cells are as large as
// their collision triangles have no such points.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "kerf/base/indexed.h"
#include "kerf/contact/contact_surface.h"
#include "kerf/embedding/embedding.h"
#include "kerf/lattice/hex_mesh.h"

namespace kerf {

/// A node at the start of a step, and where it would be at its end, touching nothing: x y z -, m.
struct alignas(32) NodeState {
  double now[4], next[4];
};

/// A place of a face, lifted to one of its sides, or of the wall over its border.
struct SidePoint {
  CollisionTriangle face;
  std::int32_t number = 0;         ///< among those of the face
  std::array<double, 3> weight{};  ///< of the face's corners
  double lift = 0;                 ///< SurfacePoint::lift
  CollisionHalfEdge border;        ///< without another face, that it lies on; or none
  std::int32_t piece = -1;  ///< not negative: it stands for this piece of the side, whose middle it is (side_piece)
  EmbeddedPoint carrier;
};

struct SidePoints {
  struct Wants {
    bool between = false;  ///< faces are larger than cells
    bool across = false;   ///< there are several cells across the thickness
  };
  std::vector<Wants> of_body;  ///< of HexMesh::bodies, each by itself
  [[nodiscard]] bool any() const {
    return std::any_of(of_body.begin(), of_body.end(), [](const Wants& w) { return w.between || w.across; });
  }

  std::vector<SidePoint> points;                       ///< by face
  IndexedArray<CollisionTriangle, std::uint32_t> end;  ///< per face: behind its last one
  std::function<bool(Vec3)>
      is_held;  ///< is a place at rest in material that supports hold? It has no points. None: nothing is held
  /// Of prisms' - and + corners that other cells hold than the vertex: a vertex then counts as the middle between them. No copy: it carries them.
  IndexedArray<CollisionVertex, std::array<EmbeddedPoint, 2>> corner;

  std::vector<Vec3> place, travel;  ///< of the points in this step, m
  std::vector<double> size;         ///< of those that stand for a piece: how far from its middle it reaches at rest, m
  double bulge = 0;                 ///< m: farthest of them from where the prism of its face has it

  // What the points of a face were made from; they are made anew when that has changed.
  IndexedArray<CollisionTriangle, std::uint64_t> made_from;
  IndexedArray<CollisionVertex, std::uint64_t> corner_from;
  IndexedArray<CollisionTriangle, std::int32_t> pieces;  ///< that the edges of a face are divided into, at least

  [[nodiscard]] std::uint32_t begin(CollisionTriangle f) const {
    return f.index() == 0 ? 0 : end[CollisionTriangle(f.value - 1)];
  }
  [[nodiscard]] bool holds(Vec3 rest) const { return is_held && is_held(rest); }
  [[nodiscard]] bool has_points(CollisionTriangle f) const { return begin(f) != end[f]; }
};

/// Weights of the corners of a piece, of n^2 that a face is divided into.
std::array<std::array<double, 3>, 3> side_piece(std::int32_t n, std::int32_t piece);

/// Which bodies need them at rest?
void choose_side_points(const HexMesh& hex, const ContactSurface& surface, SidePoints& sides);

/// After a cut, its undo or redo, and before the first step. Faces that look as they did keep their points. Cost: a look at each face and its pieces.
void renew_side_points(const HexMesh& hex, const Embedding& embedding, const ContactSurface& surface,
                       SidePoints& sides);

/// Where the points are. nodes: |N|; positions, offsets: |V_c|, deformed.
void place_side_points(const HexMesh& hex, const ContactSurface& surface, std::span<const NodeState> nodes,
                       std::span<const Vec3> positions, std::span<const Vec3> offsets, SidePoints& sides);

/// Where a carried point is, and where it would be at the end of the step, m.
struct CarriedPlace {
  Vec3 now, next;
};
CarriedPlace place_of(const HexMesh& hex, const EmbeddedPoint& point, std::span<const NodeState> nodes);

}  // namespace kerf
