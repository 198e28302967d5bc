// Is a cell complex what pre-processing promises?
#pragma once

#include "kerf/base/result.h"
#include "kerf/binding/cell_complex.h"

namespace kerf {

/// Checks a freshly bound body (no cuts yet), without trusting any index:
///  - both meshes: oriented manifolds, one fan per vertex, no border on a closed body, Euler characteristics that agree;
///  - planar images positively oriented, exactly; all corners of a vertex in one plane hold the same bits; bound vertices
///    hold the bits of their collision corners (mirrored on the - side);
///  - the cell-complex table: chains consecutive and in order, barriers exactly there, flags, every free vertex in exactly one
///    list and inside that triangle; every patch a disc.
/// The error names the first offending element (1-based). O(V) time and memory.
Status validate_binding(const CellComplex& complex);

}  // namespace kerf
