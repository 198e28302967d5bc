// One ray or point against one triangle, or a point against a segment.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "kerf/base/vec.h"

namespace kerf {

struct Ray {
  Vec3 origin, direction;  ///< direction need not be a unit vector, but not zero
  double t_min = 0, t_max = HUGE_VAL;
};

/// origin + t direction, on triangle `triangle` at these barycentric coordinates (sum 1).
struct RayHit {
  std::int32_t triangle = -1;
  double t = HUGE_VAL;
  std::array<double, 3> barycentric{};
  [[nodiscard]] bool valid() const { return triangle >= 0; }
};

struct ClosestPoint {
  std::int32_t triangle = -1;
  double distance = HUGE_VAL;  ///< metres
  Vec3 point;
  std::array<double, 3> barycentric{};  ///< exact zeros where the point lies on an edge or corner
  [[nodiscard]] bool valid() const { return triangle >= 0; }
};

/// A ray's line prepared for many triangles: its longest direction becomes the third axis and the other two are sheared
/// so that the line is that axis (Woop, Benthin and Wald 2013).
struct RayFrame {
  Vec3 origin;
  int x, y, z;
  double shear_x, shear_y, scale;
  explicit RayFrame(const Ray& ray);
};

/// Where the whole line of a ray meets a triangle, edges and corners included, from either side; false if it misses, the
/// line lies in the plane, or the triangle has no area. Exact signs of the sheared corners decide, so that a line can't
/// slip through between triangles that share an edge or a corner. Leaves the triangle id alone.
bool intersect(const RayFrame& ray, const std::array<Vec3, 3>& triangle, RayHit& hit);

/// Closest point of a triangle, which may be a segment or a point (triangle id left alone).
void closest_point(Vec3 p, const std::array<Vec3, 3>& triangle, ClosestPoint& result);

/// Metres from p to the segment a - b, which may be a point.
double distance_to_segment(Vec3 p, Vec3 a, Vec3 b);

}  // namespace kerf
