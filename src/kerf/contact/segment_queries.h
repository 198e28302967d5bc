// Closest points of segments: to a point, and of two segments.
#pragma once

#include "kerf/base/vec.h"

namespace kerf {

/// Parameter in [0, 1] of the point of segment a b that is closest to p; 0 for a segment without length.
inline double closest_on_segment(Vec3 p, Vec3 a, Vec3 b) {
  const Vec3 d = b - a;
  const double size = dot(d, d), along = dot(p - a, d);
  return !(along > 0) ? 0 : along >= size ? 1 : along / size;
}

struct SegmentPair {
  double s = 0, t = 0;  ///< parameters in [0, 1] on the first and on the second
  bool parallel = false;  ///< to rounding: then s and t are one of many solutions
  /// Both feet clearly inside: else a vertex is as near.
  [[nodiscard]] bool inside() const { return s > kEnd && s < 1 - kEnd && t > kEnd && t < 1 - kEnd; }
  static constexpr double kEnd = 1e-3;
};
/// Closest points of the segments a b and c d, either of which may be a point.
inline SegmentPair closest_of_segments(Vec3 a, Vec3 b, Vec3 c, Vec3 d) {
  const Vec3 u = b - a, v = d - c, w = a - c;
  const double uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), uw = dot(u, w), vw = dot(v, w);
  const double det = uu * vv - uv * uv;
  SegmentPair r;
  r.parallel = !(det > 1e-12 * uu * vv);
  if (!r.parallel) {
    const double s = (uv * vw - vv * uw) / det;
    r.s = s < 0 ? 0 : s > 1 ? 1 : s;
  }
  // The best t for this s, then the best s for that t.
  r.t = closest_on_segment(lerp(a, b, r.s), c, d);
  r.s = closest_on_segment(lerp(c, d, r.t), a, b);
  return r;
}

}  // namespace kerf
