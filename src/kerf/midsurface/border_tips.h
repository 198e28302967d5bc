// Corners of the border that stick out, led to where the body ends: what lies beyond the collision mesh can't be cut.
//
//         \    true tip
//      ----x  o         the sheet's border is known at triangles of the working mesh, and stops short of an acute tip
//         /
#pragma once

#include "kerf/midsurface/remesh.h"

namespace kerf::mid {

/// Of the vertices of the body's surface that hang together near a corner, the farthest out say where it is.
void reach_tips(CoarseMesh& mesh, const SurfaceMesh& surface, const TriangleBvh& bvh);

}  // namespace kerf::mid
