// What must hold of a lattice after every operation, and how many pieces it has.
#pragma once

#include <cstddef>

#include "kerf/base/result.h"
#include "kerf/lattice/hex_mesh.h"

namespace kerf {

struct HexPieces {
  std::size_t by_nodes = 0;  ///< living copies joined by any shared node
  std::size_t by_faces = 0;  ///< living copies joined by whole shared faces only: more than by_nodes means a hinge
};
/// Copies on both sides of a tip's continuation count as joined: the material between them is not cut.
HexPieces count_hex_pieces(const HexMesh& hex);

/// Connected pieces of a collision mesh (through edges).
std::size_t count_collision_pieces(const CollisionMesh& mesh);

/// Nodes that a plain lattice of the same cells would have: corners of cells with material, each counted once. Equals
/// HexMesh::node_count() right after building an uncut body, unless some of its cells meet only at an edge or corner
/// or a cell has several branches.
std::size_t count_plain_nodes(const HexMesh& hex);

/// Checks, in linear time: lists and ids are consistent; every copy has 8 distinct nodes at the right corners of the lattice; use counts of
/// nodes; absorbed copies end at living hosts; the volume of all copies, and the mass volume of the living ones, equal the
/// body's up to rounding (kVolumeRounding); the triangles on both sides of an uncut edge are, in a cell that the edge's wall passes, in the same
/// copy, or else in copies that share a face. The error names the copy, node or triangle.
Status validate_lattice(const CollisionMesh& mesh, const HexMesh& hex);

/// As many pieces by faces and by nodes as the collision mesh has?
Status validate_lattice_pieces(const CollisionMesh& mesh, const HexMesh& hex);

}  // namespace kerf
