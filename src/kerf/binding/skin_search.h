// Rays and closest points on the visual surface that know which way its faces look (4.1.1).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "kerf/base/vec.h"
#include "kerf/spatial/bvh.h"

namespace kerf {

/// A point of the surface.
struct SkinPoint {
  std::int32_t face = -1;
  Vec3 position;
  double distance = 0;  ///< from the query point, metres
};

/// Refers to the mesh it was built from.
class SkinSearch {
 public:
  /// `queries`: about how many there will be.
  SkinSearch(std::span<const Vec3> positions, std::span<const std::array<std::int32_t, 3>> triangles,
             std::size_t queries)
      : triangles_(positions, {triangles.front().data(), 3 * triangles.size()}), bvh_(triangles_, queries) {}

  /// The point nearest to p on faces whose normal n has dot(n, facing) > 0 (all faces if facing is zero), not farther than reach.
  [[nodiscard]] std::optional<SkinPoint> closest(Vec3 p, Vec3 facing, double reach) const {
    const bool any = facing == Vec3{};
    const ClosestPoint q =
        bvh_.closest(triangles_, p, reach, [&](const ClosestPoint& c) { return any || looks(c.triangle, facing); });
    if (!q.valid()) return std::nullopt;
    return SkinPoint{q.triangle, q.point, q.distance};
  }

  /// The first hit of the ray from `origin` along the unit vector `direction` on a face that looks the same way
  /// (dot(n, direction) > 0), within reach.
  [[nodiscard]] std::optional<SkinPoint> first_exit(Vec3 origin, Vec3 direction, double reach) const {
    const RayHit hit = bvh_.first_hit(triangles_, {origin, direction, 0, reach},
                                      [&](const RayHit& h) { return looks(h.triangle, direction); });
    if (!hit.valid()) return std::nullopt;
    return SkinPoint{hit.triangle, origin + hit.t * direction, hit.t};
  }

 private:
  [[nodiscard]] bool looks(std::int32_t face, Vec3 direction) const {
    const auto [a, b, c] = triangles_[face];
    return dot(cross(b - a, c - a), direction) > 0;
  }
  TriangleView triangles_;
  TriangleBvh bvh_;
};

}  // namespace kerf
