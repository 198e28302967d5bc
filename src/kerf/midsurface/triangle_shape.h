// Angles of triangles.
#pragma once

#include <algorithm>
#include <cmath>

#include "kerf/base/vec.h"

namespace kerf::mid {

/// Radians at corner a.
inline double corner_angle(Vec3 a, Vec3 b, Vec3 c) { return std::atan2(norm(cross(b - a, c - a)), dot(b - a, c - a)); }
inline double smallest_angle(Vec3 a, Vec3 b, Vec3 c) {
  return std::min({corner_angle(a, b, c), corner_angle(b, c, a), corner_angle(c, a, b)});
}
inline Vec3 triangle_normal(Vec3 a, Vec3 b, Vec3 c) { return normalized(cross(b - a, c - a)); }

}  // namespace kerf::mid
