// Takes spikes and scanner noise off a working copy of the surface, so that its two sides can be told apart. The surface
// that is bound later is never changed.
#pragma once

#include "kerf/base/progress.h"
#include "kerf/base/result.h"
#include "kerf/midsurface/surface_mesh.h"

namespace kerf::mid {

struct FilterReport {
  std::int32_t spikes = 0;         ///< vertices put back among their neighbours
  std::vector<Vec3> spike_places;  ///< where the first of them were
  int smoothing_steps = 0;
  double roughness = 0;  ///< median angle between neighbouring faces before, radians
  double steps = 0;      ///< share of the edges that turn by more than 20 degrees before: steps of voxels
};

/// Moves vertices only. Clean surfaces stay as they are, to the bit. `progress` is asked before each round.
Result<FilterReport> filter_surface(SurfaceMesh& mesh, const Progress& progress = {});

/// 2 volume / area: the mean thickness of a thin body, metres.
double mean_thickness(const SurfaceMesh& mesh);

}  // namespace kerf::mid
