// Rigid places: where a thing is and how it is turned.
#pragma once

#include <cmath>

#include "kerf/base/vec.h"

namespace kerf {

/// A frame: local x lies at position + axes x. The axes are a rotation.
struct RigidPlace {
  Vec3 position;  ///< m
  Mat3 axes;      ///< columns: the thing's axes in the world
  [[nodiscard]] Vec3 to_world(Vec3 local) const { return position + axes * local; }
  [[nodiscard]] Vec3 to_local(Vec3 world) const { return transposed_times(axes, world - position); }
  friend bool operator==(const RigidPlace&, const RigidPlace&) = default;
};

inline Mat3 product(const Mat3& a, const Mat3& b) {
  Mat3 m;
  for (std::size_t i = 0; i < 3; ++i) m.c[i] = a * b.c[i];
  return m;
}
inline Mat3 transposed(const Mat3& a) {
  Mat3 m;
  for (int i = 0; i < 3; ++i) m.c[static_cast<std::size_t>(i)] = {a.c[0][i], a.c[1][i], a.c[2][i]};
  return m;
}

/// The turn about `rotation` by its length, radians (Rodrigues' formula).
inline Mat3 turn(Vec3 rotation) {
  const double angle = norm(rotation);
  if (!(angle > 0)) return {};
  const Vec3 axis = (1 / angle) * rotation;
  const double c = std::cos(angle), s = std::sin(angle);
  Mat3 m;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 e = m.c[i];
    m.c[i] = c * e + s * cross(axis, e) + (1 - c) * dot(axis, e) * axis;
  }
  return m;
}

/// Axis times angle, radians, of a rotation; the angle is at most pi.
inline Vec3 turn_of(const Mat3& r) {
  // The quaternion, from its largest component (Shepperd's way), so that half turns are as exact as small ones.
  const double xx = r.c[0].x, yy = r.c[1].y, zz = r.c[2].z, trace = xx + yy + zz;
  double w = 0;
  Vec3 v;
  const Vec3 odd{r.c[1].z - r.c[2].y, r.c[2].x - r.c[0].z, r.c[0].y - r.c[1].x};  // 4 w v
  if (trace > xx && trace > yy && trace > zz) {
    w = 0.5 * std::sqrt(std::fmax(0.0, 1 + trace));
    v = (0.25 / w) * odd;
  } else {
    const int i = xx > yy && xx > zz ? 0 : yy > zz ? 1 : 2, j = (i + 1) % 3, k = (i + 2) % 3;
    const auto at = [&](int row, int column) { return r.c[static_cast<std::size_t>(column)][row]; };
    v[i] = 0.5 * std::sqrt(std::fmax(0.0, 1 + at(i, i) - at(j, j) - at(k, k)));
    v[j] = (at(i, j) + at(j, i)) / (4 * v[i]);
    v[k] = (at(i, k) + at(k, i)) / (4 * v[i]);
    w = odd[i] / (4 * v[i]);
  }
  const double length = norm(v);
  if (!(length > 0)) return {};
  if (w < 0) {
    w = -w;
    v = -v;
  }
  return (2 * std::atan2(length, w) / length) * v;
}

/// The place on the way from a to b: straight, and turning evenly the short way.
inline RigidPlace between(const RigidPlace& a, const RigidPlace& b, double s) {
  if (s <= 0) return a;
  if (s >= 1) return b;
  return {lerp(a.position, b.position, s), product(turn(s * turn_of(product(b.axes, transposed(a.axes)))), a.axes)};
}

}  // namespace kerf
