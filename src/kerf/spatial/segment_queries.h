// Nearest points of segments: to a point, and of two segments.
#pragma once

#include "kerf/base/vec.h"

namespace kerf {

/// Parameter in [0, 1] of the point of segment a b that is closest to p; 0 for a segment without length.
inline double closest_on_segment(Vec3 p, Vec3 a, Vec3 b) {
  const Vec3 d = b - a;
  const double size = dot(d, d), along = dot(p - a, d);
  return !(along > 0) ? 0 : along >= size ? 1 : along / size;
}

/// Where two lines are nearest: parameters on the first and on the second.
struct SegmentFeet {
  double s = 0, t = 0;
};
/// Nearest points of the segments a b and c d, if both lie clearly inside: else, and for parallel ones, an end of one of them is as
/// near, and this is false.
inline bool inner_feet(Vec3 a, Vec3 b, Vec3 c, Vec3 d, SegmentFeet& feet) {
  constexpr double kEnd = 1e-3;
  const Vec3 u = b - a, v = d - c, w = a - c;
  const double uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), uw = dot(u, w), vw = dot(v, w);
  const double det = uu * vv - uv * uv;
  if (!(det > 1e-12 * uu * vv)) return false;
  const double s = uv * vw - vv * uw, t = uu * vw - uv * uw, low = kEnd * det, high = det - low;
  if (!(s > low && s < high && t > low && t < high)) return false;
  feet = {s / det, t / det};
  return true;
}

}  // namespace kerf
