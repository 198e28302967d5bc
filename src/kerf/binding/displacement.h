// How far the visual surface is from where its parameters say it is: by so much a wall that is drawn stands beside the blade.
#pragma once

#include "kerf/binding/cell_complex.h"

namespace kerf {

/// Parts of the mean collision edge.
struct Displacement {
  double mean = 0;  ///< by area
  double largest = 0;
};

/// A corner with parameters in a collision triangle belongs to the point there, and to the line along the prism's offset at that point. Its
/// displacement is its distance to that line. Over faces that lie along the mid-surface (to 60 degrees): what stands up is side, where many points
/// share one place of the mid-surface. Before any cut. Linear time; the same for any number of threads.
Displacement measure_displacement(const CellComplex& body);

}  // namespace kerf
