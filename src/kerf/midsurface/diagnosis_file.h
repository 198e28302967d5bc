// A picture of a verdict: the surface in colours.
#pragma once

#include "kerf/midsurface/midsurface.h"

namespace kerf {

/// Writes a PLY: the + side orange, the - side blue, paler where it is unsure, red where something speaks against a thin
/// body, violet where it passes through itself, yellow where the collision mesh is bad; face properties side, confidence, thickness (metres) and flag.
Status write_diagnosis(const std::string& path, const MidsurfaceDiagnosis& diagnosis);

}  // namespace kerf
