// The collision mesh of an open sheet that is drawn finely: the sheet itself, with fewer and well-shaped triangles.
#pragma once

#include "kerf/midsurface/midsurface.h"

namespace kerf {

/// Has a sheet of so many triangles too many to be its own collision mesh?
bool is_too_fine(std::size_t triangles);

/// sheet: an oriented manifold with a border. thickness: metres, how far chords may leave the bends follows from it. Its border runs on the
/// sheet's; the same bits every time. Bad input: no border, or what build_half_edges refuses. About 5 microseconds a triangle.
Result<TriangleMesh> make_coarse_sheet(const TriangleMesh& sheet, double thickness,
                                       const MidsurfaceOptions& options = {});

}  // namespace kerf
