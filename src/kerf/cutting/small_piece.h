// Pieces that hold little material: what a stroke may leave as dust (docs/cutting.md, "Dust").
#pragma once

#include <span>
#include <vector>

#include "kerf/binding/cell_complex.h"
#include "kerf/cutting/cut_scratch.h"

namespace kerf {

struct SmallPiece {
  std::vector<CollisionTriangle> triangles;  ///< all that it has
  double volume = 0;                         ///< m^3 that its skin encloses at rest
};

/// The pieces of a closed body that hold one of `faces` and enclose less than `most` m^3, each once; none in an open sheet.
/// Cost: the faces of small pieces, and around each of `faces` that is in a larger one those of a few times `most`.
std::vector<SmallPiece> small_pieces(const CellComplex& body, std::span<const CollisionTriangle> faces, double most,
                                     CutScratch& scratch);

}  // namespace kerf
