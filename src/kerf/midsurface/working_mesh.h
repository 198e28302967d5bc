// The mesh that sides are told apart on: nearly uniform triangles, 8,000 to 50,000 of them, whatever came in. It makes
// twelve triangles and a million the same problem.
#pragma once

#include "kerf/base/progress.h"
#include "kerf/base/result.h"
#include "kerf/midsurface/surface_mesh.h"

namespace kerf::mid {

struct WorkingMesh {
  SurfaceMesh mesh;
  double edge = 0;         ///< wanted edge length, metres
  double thickness = 0;    ///< of a closed surface t0 = 2 volume / area, metres
  bool coarsened = false;  ///< it is not the very surface any more
  bool rough = false;      ///< it has far more triangles than it should: collapses would move the surface too far
};

/// The first half of make_working_mesh: short edges are collapsed.
Result<WorkingMesh> coarse_working_mesh(SurfaceMesh filtered, double thickness = 0, const Progress& progress = {});
/// The second one: long edges are split.
Status divide_working_mesh(WorkingMesh& work, const Progress& progress = {});
/// Short edges of the (filtered) surface are collapsed where that moves it and its border by less than 2 % of the thickness, long ones are
/// split in the middle. thickness: metres, of an open sheet; 0: a closed surface has a mean one. About linear.
/// `progress` is asked between passes over the edges.
Result<WorkingMesh> make_working_mesh(SurfaceMesh filtered, double thickness = 0, const Progress& progress = {});

}  // namespace kerf::mid
