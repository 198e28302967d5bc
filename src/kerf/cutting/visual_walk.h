// Making straight chords edge paths, and inserting points, in the planar triangulation of a patch. Every step tests
// against the current vertex and the live triangulation with exact predicates, so rounding never accumulates.
#pragma once

#include "kerf/cutting/cut_context.h"
#include "kerf/cutting/visual_split.h"

namespace kerf::cut {

/// Makes the straight chord p - q in the plane of `patch` a path of barrier edges; p and q are vertices of the patch
/// that see each other. Its inner vertices go to scratch.path, from p to q; they are no longer free.
/// Cost: one fan per crossed edge.
bool walk_chord(CutContext& cut, VisualVertex p, VisualVertex q, Patch patch);

/// A vertex at u in the plane of `patch`: a free vertex nearby whose parameter is moved, or a new one. `from` is a
/// vertex of the patch that sees u. None after a failure.
VisualVertex insert_point(CutContext& cut, VisualVertex from, Vec2 u, Patch patch);

}  // namespace kerf::cut
