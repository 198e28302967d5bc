// Exact signs: on which side of a line or plane does a point lie? Right for all finite doubles, however close to
// degenerate: a floating-point filter decides nearly always, whole-number arithmetic the rest.
#pragma once

#include <cmath>

#include "kerf/base/vec.h"

namespace kerf {

namespace exact {
/// The signs by whole numbers alone; orient2d and orient3d fall back on them. About 0.1 to 1 microsecond.
int orient2d(Vec2 a, Vec2 b, Vec2 c);
int orient3d(Vec3 a, Vec3 b, Vec3 c, Vec3 d);

// Rounding of the two determinants, relative to the sum of their terms' sizes: 3 and 7 roundings and a little
// (Shewchuk 1997). Below kUnderflow products lose digits, so the filter does not decide there.
constexpr double kFilter2d = 3.3306690738754716e-16;
constexpr double kFilter3d = 7.7715611723761027e-16;
constexpr double kUnderflow = 1e-300;
}  // namespace exact

/// +1 if a, b, c turn counter-clockwise, -1 if clockwise, 0 if they lie on one line.
inline int orient2d(Vec2 a, Vec2 b, Vec2 c) {
  const double l = (a.x - c.x) * (b.y - c.y), r = (a.y - c.y) * (b.x - c.x), det = l - r;
  const double error = exact::kFilter2d * (std::fabs(l) + std::fabs(r)) + exact::kUnderflow;
  if (det > error) return 1;
  if (-det > error) return -1;
  return exact::orient2d(a, b, c);
}

/// As orient3d, where the filter decides; 0 where it does not.
inline int surely_orient3d(Vec3 a, Vec3 b, Vec3 c, Vec3 d) {
  const Vec3 u = b - a, v = c - a, w = d - a;
  const double xy = u.x * v.y, yx = u.y * v.x, yz = u.y * v.z, zy = u.z * v.y, zx = u.z * v.x, xz = u.x * v.z;
  const double det = (xy - yx) * w.z + (yz - zy) * w.x + (zx - xz) * w.y;
  const double wx = std::fabs(w.x), wy = std::fabs(w.y), wz = std::fabs(w.z);
  const double size = (std::fabs(xy) + std::fabs(yx)) * wz + (std::fabs(yz) + std::fabs(zy)) * wx +
                      (std::fabs(zx) + std::fabs(xz)) * wy;
  const double error = exact::kFilter3d * size + exact::kUnderflow * (1 + wx + wy + wz);
  return det > error ? 1 : -det > error ? -1 : 0;
}

/// +1 if d lies on the side of the plane a b c that its counter-clockwise normal points to, -1 on the other side, 0 in
/// the plane: the sign of (b - a) x (c - a) . (d - a).
inline int orient3d(Vec3 a, Vec3 b, Vec3 c, Vec3 d) {
  const int sign = surely_orient3d(a, b, c, d);
  return sign != 0 ? sign : exact::orient3d(a, b, c, d);
}

}  // namespace kerf
