// Which copy of a cell every visual and collision vertex moves with (4.2.1, 4.2.5).
//
// A vertex is found through its owner in the cell complex: of the pieces of material of the collision triangle(s) that own
// it, the one in the cell that the vertex lies in at rest; where there is none (skin that bulges beyond the
// prisms), the nearest one, kept until it is no longer theirs. Material of absorbed copies moves with their host. Local coordinates
// follow from the rest position and the copy's cell, so they may leave [-1, 1].
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kerf/base/journal.h"
#include "kerf/base/result.h"
#include "kerf/binding/cell_complex.h"
#include "kerf/lattice/hex_mesh.h"

namespace kerf {

struct Embedding {
  Journaled<VisualVertex, HexId> visual;             ///< living copy of every visual vertex
  Journaled<CollisionVertex, HexId> collision;       ///< living copy of every collision vertex
  Journaled<CollisionVertex, Vec3> collision_local;  ///< its coordinates in that copy's cell

  template <class Fn>
  void for_each_array(Fn&& f) {
    f(visual);
    f(collision);
    f(collision_local);
  }
};

/// Memory kept between calls; contents are private.
struct EmbeddingScratch {
  std::vector<std::uint32_t> hex_stamp;
  std::uint32_t serial = 0;
  std::vector<CollisionTriangle> triangles;
};

/// Embeds every vertex of a body. Fails, naming it, on a visual vertex that no collision element owns. Linear.
Status embed_all(const CellComplex& body, const HexMesh& hex, Embedding& embedding);

/// Brings up to date what the given triangles own, after a cut and adapt_lattice: LatticeChange::triangles, which hold
/// those that the cut changed (any order, repeats allowed). Vertices that got another copy, and new ones, are
/// appended to `moved` (a few may come twice). Cost: a comparison per owned vertex, a look-up per moved one.
void embed_triangles(const CellComplex& body, const HexMesh& hex, std::span<const CollisionTriangle> triangles,
                     Embedding& embedding, EmbeddingScratch& scratch, std::vector<VisualVertex>& moved);

/// Trilinear weights of the 8 corners at local coordinates; they add up to 1, outside of [-1, 1] some are negative.
constexpr std::array<double, 8> trilinear_weights(Vec3 local) {
  std::array<double, 8> w{};
  for (std::size_t c = 0; c < 8; ++c)
    w[c] = 0.125 * (c & 1 ? 1 + local.x : 1 - local.x) * (c & 2 ? 1 + local.y : 1 - local.y) *
           (c & 4 ? 1 + local.z : 1 - local.z);
  return w;
}

/// A point of the body: a rest position that moves with a copy.
struct EmbeddedPoint {
  HexId copy;
  Vec3 local;
};
struct NodeForces {
  std::array<NodeId, 8> node;
  std::array<Vec3, 8> force;
};

/// 8 weights of a rest point in a copy.
inline std::array<double, 8> weights(const HexMesh& hex, HexId copy, Vec3 rest_point) {
  return trilinear_weights(hex.local(copy, rest_point));
}
/// Where an embedded point is, from the positions of all nodes (|N|).
Vec3 point_position(const HexMesh& hex, EmbeddedPoint point, std::span<const Vec3> nodes);
/// The transpose: a force (N) on an embedded point as forces on the 8 nodes. Same force, same moment at rest.
NodeForces spread_force(const HexMesh& hex, EmbeddedPoint point, Vec3 force);

/// The copy for a rest point owned by a collision triangle, by the rule above: for contacts, grasps, attachments.
EmbeddedPoint embed_point(const HexMesh& hex, CollisionTriangle owner, Vec3 rest_point);
/// The same for a point that several triangles of one body own. No copy: they have no material.
EmbeddedPoint embed_point(const HexMesh& hex, std::span<const CollisionTriangle> owners, Vec3 rest_point);

/// Positions (or, from node velocities, velocities) of all collision vertices. nodes: |N|, out: |V_c|.
void collision_positions(const HexMesh& hex, const Embedding& embedding, std::span<const Vec3> nodes,
                         std::span<Vec3> out);

/// Derivative of the deformation by the rest position at an embedded point. nodes: |N| positions.
Mat3 deformation_gradient(const HexMesh& hex, EmbeddedPoint point, std::span<const Vec3> nodes);
/// A rest normal (unit) carried along by the deformation: cofactor matrix times normal, normalised. For walls, whose corners
/// have flat normals of their own. A flattened cell gives the rest normal back.
Vec3 deformed_normal(const HexMesh& hex, EmbeddedPoint point, Vec3 rest_normal, std::span<const Vec3> nodes);

}  // namespace kerf
