// Several bodies in one cell complex: what is bound by itself is moved to its place and put beside the others.
#pragma once

#include "kerf/base/rigid_place.h"
#include "kerf/binding/cell_complex.h"

namespace kerf {

/// Moves a complex at rest: positions, offsets and normals. Planes and everything in them stay.
void place_complex(const RigidPlace& place, CellComplex& complex);

/// Puts `part` behind `whole`: all its ids follow those of `whole`, in order. Both must be closed, or both open (the caller
/// checks it). Linear in `part`. The mean edge becomes the lesser of both: what is exact enough
/// for the finer body is for the coarser one.
void append_complex(const CellComplex& part, CellComplex& whole);

/// One more than the greatest root of a complex.
std::int32_t root_count(const CellComplex& complex);

}  // namespace kerf
