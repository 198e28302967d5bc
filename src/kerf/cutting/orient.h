// Which side of a line a point lies on: exact sign.
#pragma once

#include "kerf/base/vec.h"

namespace kerf::cut {

/// Twice the signed area of the triangle a b c: > 0 when c is left of a -> b. The sign is exact (barring overflow and
/// underflow), the value has a small relative error. Shewchuk's first filter, then an expansion sum.
double orient2d_exact(Vec2 a, Vec2 b, Vec2 c);

inline double orient(Vec2 a, Vec2 b, Vec2 c) {
  const double left = (a.x - c.x) * (b.y - c.y);
  const double right = (a.y - c.y) * (b.x - c.x);
  const double det = left - right;
  const double bound = 3.3306690738754716e-16 * (std::fabs(left) + std::fabs(right));
  if (det > bound || -det > bound) return det;
  return orient2d_exact(a, b, c);
}

}  // namespace kerf::cut
