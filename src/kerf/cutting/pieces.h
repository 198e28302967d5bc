// Connected pieces of the collision mesh and the visual mesh.
#pragma once

#include <cstdint>
#include <vector>

#include "kerf/binding/cell_complex.h"

namespace kerf {

struct Pieces {
  std::vector<std::int32_t> of_face;  ///< |F|: piece of every face, numbered 0, 1, ... by its lowest face
  std::int32_t count = 0;
};

/// Pieces of the collision mesh, joined across edges. Cost: linear.
Pieces collision_pieces(const CellComplex& body);
Pieces collision_pieces(const CollisionMesh& mesh);
/// Pieces of the visual mesh. A closed body whose sides have no common rim (a shell) counts its two walls apart.
Pieces visual_pieces(const CellComplex& body);

/// Piece of one collision triangle in an answer of collision_pieces.
inline std::int32_t piece_of_triangle(const Pieces& pieces, CollisionTriangle f) { return pieces.of_face[f.index()]; }

}  // namespace kerf
