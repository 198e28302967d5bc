// How well an operation went: what of a marked lesion is gone, what else is, and what is left behind (paper 5.3).
#pragma once

#include "kerf/binding/cell_complex.h"
#include "kerf/scene/scene.h"

namespace kerf {

/// Material at rest, m^3, as the prisms of the collision mesh hold it. Bumps of cut surfaces do not count.
struct TissueVolume {
  double lesion = 0, healthy = 0;
};

/// Inside a region and outside of it. Every collision triangle is divided into kLesionDivisions^2 parts, and those that the region's
/// border runs through are quartered kLesionDepth times: the border is followed to 1/512 of a triangle.
TissueVolume tissue_volume(const CellComplex& body, const SceneRegion& lesion);
inline constexpr int kLesionDivisions = 4, kLesionDepth = 7;

struct TrainerScore {
  double lesion_volume = 0;    ///< m^3 at the start
  double lesion_removed = 0;   ///< share of it that is gone, 0 to 1; loose pieces that still lie about are not gone
  double healthy_removed = 0;  ///< m^3 of anything else that is gone
  double healthy_share = 0;    ///< of what there was
  int loose_pieces = 0;        ///< left behind
  double roughness = 0;        ///< metres: RMS of the cut surfaces from which something is gone; slits have none
  double largest_force = 0;    ///< N: Session::ToolState::force of a tool, in any step (mean over it)
  double time = 0;             ///< s, simulated
};

}  // namespace kerf
