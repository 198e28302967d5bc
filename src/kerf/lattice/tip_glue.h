// Springs that hold the cell of a slit's tip together while the tip crosses it (4.2.1).
//
// The tip's cell is split as if the slit ran on to the cell's far face, so that the last piece of the drawn slit can open;
// springs between the twin nodes stand for the material that still holds. They fade as the tip advances:
// 0.2 E h (1 - s) / s in all, s the share of the cell that is passed, h the cell's size across the thickness. So the
// compliance grows without a jump when the tip crosses from cell to cell.
#pragma once

#include <vector>

#include "kerf/lattice/hex_mesh.h"

namespace kerf {

struct TipGlue {
  NodeId a, b;  ///< twins on the left and the right of the slit, at the same lattice corner
  HexId copy;   ///< one of those that they belong to
  double stiffness_over_e =
      0;  ///< metres: times Young's modulus it is the spring's stiffness (N/m), in every direction
};

/// The copies left and right of a tip's continuation in its cell; equal or none if the split came to nothing.
struct TipCopies {
  HexId left, right;
};
TipCopies tip_copies(const HexMesh& hex, TipId tip);
/// Those that carry the left and the right lip to a vertex where a slit ends, in the cell that it lies nearest to.
TipCopies copies_of_lips(const HexMesh& hex, CollisionVertex tip, Vec3 rest_point);

/// All springs, ordered by tip and corner. A tip that splits nothing has none. Cost: linear in the tips there ever were.
void tip_glue(const HexMesh& hex, std::vector<TipGlue>& out);

}  // namespace kerf
