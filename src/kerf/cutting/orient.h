// Which side of a line a point lies on: the exact sign with a size.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "kerf/spatial/predicates.h"

namespace kerf::cut {

/// Twice the signed area of the triangle a b c: > 0 when c is left of a -> b. The sign is exact; the size has a small
/// relative error except where it is smaller than the rounding of its terms.
inline double orient(Vec2 a, Vec2 b, Vec2 c) {
  const double left = (a.x - c.x) * (b.y - c.y), right = (a.y - c.y) * (b.x - c.x), det = left - right;
  const double error = exact::kFilter2d * (std::fabs(left) + std::fabs(right)) + exact::kUnderflow;
  if (det > error || -det > error) return det;
  const int sign = exact::orient2d(a, b, c);
  return sign == 0 ? 0.0 : std::copysign(std::max(std::fabs(det), std::numeric_limits<double>::min()), sign);
}

}  // namespace kerf::cut
