// Small fixed-size vectors and matrices for public interfaces (no Eigen there: its alignment differs between
// builds). Plain aggregates, double precision unless named otherwise.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

namespace kerf {

struct Vec2 {
  double x = 0, y = 0;
  friend constexpr bool operator==(const Vec2&, const Vec2&) = default;
};
struct Vec3 {
  double x = 0, y = 0, z = 0;
  constexpr double& operator[](int i) { return i == 0 ? x : i == 1 ? y : z; }
  constexpr double operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
  friend constexpr bool operator==(const Vec3&, const Vec3&) = default;
};
struct Vec2f {
  float x = 0, y = 0;
  friend constexpr bool operator==(const Vec2f&, const Vec2f&) = default;
};
struct Vec3f {
  float x = 0, y = 0, z = 0;
  friend constexpr bool operator==(const Vec3f&, const Vec3f&) = default;
};

constexpr Vec2 operator+(Vec2 a, Vec2 b) { return {a.x + b.x, a.y + b.y}; }
constexpr Vec2 operator-(Vec2 a, Vec2 b) { return {a.x - b.x, a.y - b.y}; }
constexpr Vec2 operator*(double s, Vec2 a) { return {s * a.x, s * a.y}; }
constexpr double dot(Vec2 a, Vec2 b) { return a.x * b.x + a.y * b.y; }
constexpr double cross(Vec2 a, Vec2 b) { return a.x * b.y - a.y * b.x; }
inline double norm(Vec2 a) { return std::sqrt(dot(a, a)); }
/// a at t = 0, b at t = 1. Every interpolation goes through lerp, so that the same two points and the same
/// fraction give the same bits.
constexpr Vec2 lerp(Vec2 a, Vec2 b, double t) { return {a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)}; }

constexpr Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
constexpr Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
constexpr Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
constexpr Vec3 operator*(double s, Vec3 a) { return {s * a.x, s * a.y, s * a.z}; }
constexpr Vec3& operator+=(Vec3& a, Vec3 b) { return a = a + b; }
constexpr Vec3& operator-=(Vec3& a, Vec3 b) { return a = a - b; }
constexpr double dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr Vec3 cross(Vec3 a, Vec3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
inline double norm(Vec3 a) { return std::sqrt(dot(a, a)); }
/// Component by component.
inline Vec3 absolute(Vec3 v) { return {std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)}; }
/// Unit vector; the zero vector stays zero.
inline Vec3 normalized(Vec3 a) {
  const double n = norm(a);
  return n > 0 ? (1 / n) * a : Vec3{};
}
constexpr Vec3 lerp(Vec3 a, Vec3 b, double t) {
  return {a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), a.z + t * (b.z - a.z)};
}
inline bool is_finite(Vec3 a) { return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z); }

constexpr Vec3f to_float(Vec3 a) { return {static_cast<float>(a.x), static_cast<float>(a.y), static_cast<float>(a.z)}; }
constexpr Vec3 to_double(Vec3f a) { return {a.x, a.y, a.z}; }
constexpr Vec2f lerp(Vec2f a, Vec2f b, double t) {
  const float s = static_cast<float>(t);
  return {a.x + s * (b.x - a.x), a.y + s * (b.y - a.y)};
}
constexpr Vec3f lerp(Vec3f a, Vec3f b, double t) {
  const float s = static_cast<float>(t);
  return {a.x + s * (b.x - a.x), a.y + s * (b.y - a.y), a.z + s * (b.z - a.z)};
}

/// One order of places: by x, then y, then z.
constexpr bool is_less(Vec3 a, Vec3 b) { return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z; }

/// 3 x 3 matrix, columns c[0..2]: (m * v) = v.x c[0] + v.y c[1] + v.z c[2].
struct Mat3 {
  std::array<Vec3, 3> c{Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
  friend constexpr bool operator==(const Mat3&, const Mat3&) = default;
};
constexpr Vec3 operator*(const Mat3& m, Vec3 v) { return v.x * m.c[0] + v.y * m.c[1] + v.z * m.c[2]; }
/// Transposed matrix times vector.
constexpr Vec3 transposed_times(const Mat3& m, Vec3 v) { return {dot(m.c[0], v), dot(m.c[1], v), dot(m.c[2], v)}; }

/// Axis-aligned box; empty until the first point is added.
struct Box3 {
  Vec3 min{HUGE_VAL, HUGE_VAL, HUGE_VAL}, max{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  void add(Vec3 p) {
    min = {std::min(min.x, p.x), std::min(min.y, p.y), std::min(min.z, p.z)};
    max = {std::max(max.x, p.x), std::max(max.y, p.y), std::max(max.z, p.z)};
  }
  [[nodiscard]] bool empty() const { return min.x > max.x; }
  [[nodiscard]] Vec3 size() const { return empty() ? Vec3{} : max - min; }
  [[nodiscard]] Vec3 center() const { return 0.5 * (min + max); }
  [[nodiscard]] double diagonal() const { return norm(size()); }
};

}  // namespace kerf
