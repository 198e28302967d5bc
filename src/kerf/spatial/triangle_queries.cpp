#include "kerf/spatial/triangle_queries.h"

#include <algorithm>

#include "kerf/spatial/predicates.h"
#include "kerf/spatial/segment_queries.h"

namespace kerf {

RayFrame::RayFrame(const Ray& ray) : origin(ray.origin) {
  const Vec3 d = ray.direction;
  z = std::fabs(d.x) > std::fabs(d.y) ? (std::fabs(d.x) > std::fabs(d.z) ? 0 : 2)
                                      : (std::fabs(d.y) > std::fabs(d.z) ? 1 : 2);
  x = (z + 1) % 3;
  y = (z + 2) % 3;
  shear_x = d[x] / d[z];
  shear_y = d[y] / d[z];
  scale = 1 / d[z];
}

bool intersect(const RayFrame& ray, const std::array<Vec3, 3>& triangle, RayHit& hit) {
  std::array<Vec2, 3> p;
  std::array<double, 3> depth;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 corner = triangle[k] - ray.origin;
    depth[k] = corner[ray.z];
    p[k] = {corner[ray.x] - ray.shear_x * depth[k], corner[ray.y] - ray.shear_y * depth[k]};
  }
  bool left = false, right = false;
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec2 b = p[(k + 1) % 3], c = p[(k + 2) % 3];
    const int sign = orient2d(b, c, {});
    left = left || sign > 0;
    right = right || sign < 0;
    if (left && right) return false;
    const double area = cross(b, c);  // keeps the exact sign, or is rounded to nothing
    hit.barycentric[k] = area * sign > 0 ? area : 0;
    sum += hit.barycentric[k];
  }
  if (!(std::fabs(sum) > 0)) return false;
  double z = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    hit.barycentric[k] /= sum;
    z += hit.barycentric[k] * depth[k];
  }
  hit.t = z * ray.scale;
  return true;
}

namespace {

void offer_segment(Vec3 p, const std::array<Vec3, 3>& triangle, std::size_t i, std::size_t j, ClosestPoint& best) {
  const Vec3 edge = triangle[j] - triangle[i];
  const double size = dot(edge, edge), along = dot(p - triangle[i], edge);
  const double t = !(along > 0) ? 0 : along >= size ? 1 : along / size;
  const Vec3 q = t == 1 ? triangle[j] : lerp(triangle[i], triangle[j], t);
  const double distance = norm(p - q);
  if (best.distance <= distance) return;
  best.distance = distance;
  best.point = q;
  best.barycentric = {};
  best.barycentric[i] = 1 - t;
  best.barycentric[j] = t;
}

// Of the triangle's squared longest edge: flatter ones have no reliable inside and count as their edges.
constexpr double kNeedle = 1e-14;

}  // namespace

void closest_point(Vec3 p, const std::array<Vec3, 3>& triangle, ClosestPoint& result) {
  const Vec3 ab = triangle[1] - triangle[0], ac = triangle[2] - triangle[0], ap = p - triangle[0];
  const Vec3 n = cross(ab, ac);
  const double area = dot(n, n);
  const double size = std::max({dot(ab, ab), dot(ac, ac), dot(ac - ab, ac - ab)});
  if (area > kNeedle * kNeedle * size * size) {
    const double wb = dot(n, cross(ap, ac)) / area, wc = dot(n, cross(ab, ap)) / area, wa = 1 - wb - wc;
    if (wa > 0 && wb > 0 && wc > 0) {
      result.barycentric = {wa, wb, wc};
      result.point = triangle[0] + wb * ab + wc * ac;
      result.distance = norm(p - result.point);
      return;
    }
  }
  result.distance = HUGE_VAL;
  offer_segment(p, triangle, 0, 1, result);
  offer_segment(p, triangle, 1, 2, result);
  offer_segment(p, triangle, 2, 0, result);
}

double distance_to_segment(Vec3 p, Vec3 a, Vec3 b) { return norm(p - lerp(a, b, closest_on_segment(p, a, b))); }

}  // namespace kerf
