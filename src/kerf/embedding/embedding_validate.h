// What must hold of the embeddings after every operation.
#pragma once

#include <cstddef>

#include "kerf/base/result.h"
#include "kerf/binding/cell_complex.h"
#include "kerf/embedding/embedding.h"

namespace kerf {

/// How far vertices lie outside of the cell of their copy.
struct EmbeddingReach {
  std::size_t outside = 0;  ///< visual vertices outside of it
  double farthest = 0;      ///< cells; beyond about 1 the trilinear extrapolation gets rough
};
EmbeddingReach embedding_reach(const CellComplex& body, const HexMesh& hex, const Embedding& embedding);

/// Checks, for every visual and collision vertex: it has a living copy; that copy holds material of one of the triangles that own the
/// vertex; the copy's nodes at rest reproduce the vertex's rest position (1e-9 of the cell). Linear. Names the vertex.
Status validate_embedding(const CellComplex& body, const HexMesh& hex, const Embedding& embedding);

}  // namespace kerf
