// What must hold after every cut: the invariants of the cell complex, checked in full.
#pragma once

#include "kerf/base/result.h"
#include "kerf/binding/cell_complex.h"

namespace kerf {

/// Quantities that no cut changes.
struct ComplexMeasures {
  double skin_area = 0;       ///< of the visual mesh at rest without walls, square metres
  double volume = 0;          ///< enclosed by a closed visual mesh at rest, cubic metres; 0 for an open sheet
  double collision_area = 0;  ///< of the collision mesh, in its root planes, square metres
  Vec3 size;                  ///< of the bounding box at rest, metres
};
ComplexMeasures measure_complex(const CellComplex& body);

/// Both meshes are oriented manifolds with one fan per vertex; a closed body has no border; chi(visual) = chi(collision),
/// or twice that for a closed body; as many pieces, and the same ones; area and volume as at the start (1e-9, or 1e-13 of the
/// box then); every planar image exactly positively oriented and the same bits at all corners of a vertex in a plane; chains
/// consecutive and ordered with bound ends; every visual vertex in exactly one place; free ones inside their triangle;
/// lines, walls and barriers consistent; nothing infinite. The error names the ids. Cost: n log n.
Status validate_complex(const CellComplex& body, const ComplexMeasures& at_start);

/// Every piece of a closed body, with the walls of its cuts, encloses a volume above rounding (1e-13 of the box at the start). Apart from
/// validate_complex, as it asks that parameters fit the surface: bodies made by hand in tests have some that do not. Call validate_complex first. Linear time.
Status validate_piece_volumes(const CellComplex& body, const ComplexMeasures& at_start);

}  // namespace kerf
