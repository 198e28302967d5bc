// A whole stroke at once, through a body that keeps still.
#pragma once

#include <span>

#include "kerf/cutting/blade_sweep.h"

namespace kerf {

/// Leads a blade from edge to edge (see check_edge) and cuts all that it passes. `through`: every layer, not only one. Cost: a look at every
/// collision triangle if the boxes are new, then local.
SweepReport cut_along(std::span<const BladeEdge> edges, bool through, SweepTarget& target);

}  // namespace kerf
