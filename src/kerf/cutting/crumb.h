// Pieces that a cut must not leave: thinner than what counts as a feature, or with nothing of the material in them (docs/cutting.md, "From tool motion to a
// cut path").
#pragma once

#include <span>

#include "kerf/binding/cell_complex.h"
#include "kerf/cutting/cut_scratch.h"

namespace kerf {

/// Is one of these faces in a small piece whose mean width at rest is below `width`, in metres, or, in a closed body, whose skin encloses nothing or is turned
/// inside out? Small: of kCrumbArea at most. The mean width of a strip is its width, of a disc its radius.
/// Cost: the faces of small pieces, and a few for each face that is in a larger one.
bool is_in_crumb(const CellComplex& body, std::span<const CollisionTriangle> faces, double width, CutScratch& scratch);

/// m^3 that the skin of the piece with this face encloses at rest; a closed body. Cost: its visual triangles.
double enclosed_by(const CellComplex& body, CollisionTriangle of_piece, CutScratch& scratch);

}  // namespace kerf
