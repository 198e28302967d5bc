// The matrix of a turn.
#pragma once

#include <cmath>

#include "kerf/base/vec.h"

namespace kerf::testing_support {

/// Radians about an axis of any length.
inline Mat3 rotation_about(Vec3 axis, double angle) {
  const Vec3 k = normalized(axis);
  Mat3 r;
  for (int j = 0; j < 3; ++j) {
    const Vec3 e = Mat3{}.c[j];
    r.c[j] = std::cos(angle) * e + std::sin(angle) * cross(k, e) + (1 - std::cos(angle)) * dot(k, e) * k;
  }
  return r;
}

}  // namespace kerf::testing_support
