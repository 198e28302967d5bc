// The hexahedra of a body (4.2.1).
#pragma once

#include "kerf/base/result.h"
#include "kerf/lattice/hex_mesh.h"

namespace kerf {

/// Builds the hexahedra of a collision mesh, cut or not. volume: m^3 of the body (closed: what its visual mesh
/// encloses; open: area x thickness); 0: what the prisms hold. Several bodies: where their roots start, their volumes, and
/// their frames, whose indices are laid side by side here. Copies, nodes, integrals: see hex_mesh.h; branches
/// from the start, so two folds in one cell do not stick together. Refuses: coordinates that are not finite, a body whose
/// prisms hold no volume, a lattice that its body is not inside of, more than kMaxLatticeCells cells in all. Cost: linear
/// in triangles and cells.
Result<HexMesh> build_lattice(const CollisionMesh& mesh, std::vector<LatticeBody> bodies);
Result<HexMesh> build_lattice(const CollisionMesh& mesh, const LatticeFrame& frame, double volume = 0);

}  // namespace kerf
