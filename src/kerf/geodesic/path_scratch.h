// What find_path keeps between calls: memory only, nothing that a later result depends on.
#pragma once

#include "kerf/geodesic/exact_windows.h"
#include "kerf/geodesic/straighten.h"
#include "kerf/geodesic/strip.h"
#include "kerf/geodesic/walled_surface.h"

namespace kerf {

struct PathScratch {
  CorridorSearch corridor;
  Straightener straightener;
  ExactSearch exact;
  Strip strip, other_strip;
};

}  // namespace kerf
