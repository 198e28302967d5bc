// How far what is drawn lies beside where its parameters say it is.
#pragma once

#include "kerf/binding/cell_complex.h"

namespace kerf {

/// In parts of the mean edge of the collision mesh.
struct Displacement {
  double mean = 0;  ///< by area
  double largest = 0;
};

/// A visual corner with weights (a, b, c) belongs above P, the sum of its collision corners by these weights, along n, the sum of their
/// offsets. Its displacement is the part of x - P at right angles to n: a wall that is cut at P is drawn that far from the blade.
/// Over faces of the skin flatter than 60 degrees to the mid-surface; the side of a body stands along n. Freshly bound bodies only. Linear.
Displacement measure_displacement(const CellComplex& complex);

}  // namespace kerf
