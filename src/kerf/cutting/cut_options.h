// Options of cutting. Lengths are relative to CellComplex::mean_root_edge.
#pragma once

#include <cstdint>

#include "kerf/base/result.h"

namespace kerf {

struct CutOptions {
  int layers = 2;                  ///< layers of wall faces across the thickness of a closed body, 1 to 1000
  double minimum_feature = 0.024;  ///< nothing shorter is cut or left over; 0 to 0.25, never below kLeastFeature
  double path_tolerance = 0.024;   ///< how far the cut may stray from the blade's path between its vertices; at least 0
  bool flips = true;               ///< Delaunay flips of collision edges that own nothing
  double roughness = 0;    ///< inner wall vertices stray sideways by up to this part of a layer's height (0 to 0.5)
  std::uint64_t seed = 1;  ///< of the roughness
};

/// Bad input: what lies outside of the ranges above.
Status check_cut_options(const CutOptions& options);

}  // namespace kerf
