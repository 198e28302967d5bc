// The last step to the true middle: vertices move along rays to both sides until these are equally long.
#pragma once

#include "kerf/midsurface/remesh.h"
#include "kerf/midsurface/two_sided_ray.h"

namespace kerf::mid {

struct RelaxReport {
  std::vector<std::int32_t> blind;  ///< inner vertices whose rays do not meet both sides in the end
};

/// Five rounds of moves and tangential smoothing, then half thicknesses from a last look. Vertices stay within 0.6 half
/// thicknesses of the sheet. Border vertices stay on their curves; their half thickness is that of the rim's wall, half a
/// thickness inside.
RelaxReport relax_to_middle(CoarseMesh& mesh, const SheetSampler& sampler, const SheetSizes& sizes,
                            const TwoSidedRays& rays);

}  // namespace kerf::mid
