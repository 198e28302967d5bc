// The 3 x 3 diagonal blocks of the system, one per node: as xx yy zz xy, yz zx - -.
#pragma once

#include "kerf/base/lanes.h"

namespace kerf {

/// Writes the inverse of a symmetric block as three columns of four doubles.
inline void store_inverse(const Lanes& first, const Lanes& second, double* out) {
  const double xx = first[0], yy = first[1], zz = first[2], xy = first[3], yz = second[0], zx = second[1];
  const double cxx = yy * zz - yz * yz, cxy = yz * zx - xy * zz, czx = xy * yz - zx * yy;
  const double inverse = 1 / (xx * cxx + xy * cxy + zx * czx);
  const double cyy = xx * zz - zx * zx, cyz = xy * zx - xx * yz, czz = xx * yy - xy * xy;
  store_lanes(out, inverse * Lanes{cxx, cxy, czx, 0});
  store_lanes(out + 4, inverse * Lanes{cxy, cyy, cyz, 0});
  store_lanes(out + 8, inverse * Lanes{czx, cyz, czz, 0});
}

}  // namespace kerf
