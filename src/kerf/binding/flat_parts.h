// Flat parts of the visual surface, triangulated evenly: fans and long strips, as CAD programs make them, would be cut into very many slivers by paths.
#pragma once

#include <cstddef>

#include "kerf/binding/split_surface.h"

namespace kerf {

struct FlatPartLimits {
  double spoke = 0;  ///< metres; parts with a thin triangle that has a longer inner edge are triangulated anew
  double edge = 0;   ///< metres; edges of these parts that are longer are halved, longest first
  std::size_t most_faces = 0;  ///< until there are so many
};

/// Gives such flat parts Delaunay triangles by flips and halving, and marks them (SplitSurface::flat). The same set of points, the same texture. A part
/// with a texture map for each of its triangles is left. No walls yet. The faces of the result are their own parents. False if there was nothing to do.
bool even_flat_parts(SplitSurface& surface, const FlatPartLimits& limits);

/// Delaunay triangles once more in the marked parts, when bound points have been inserted: most paths then find an edge that leads there.
void even_bound_points(SplitSurface& surface);

}  // namespace kerf
