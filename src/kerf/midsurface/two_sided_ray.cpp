#include "kerf/midsurface/two_sided_ray.h"

namespace kerf::mid {
namespace {

constexpr double kFacing = 0.2;  // cosine between a ray and the smoothed normal where it leaves the body

}  // namespace

std::optional<TwoSidedRays::Ends> TwoSidedRays::both(Vec3 p, Vec3 direction) const {
  if (direction == Vec3{}) return std::nullopt;
  Ends out;
  out.hit.direction = direction;
  Vec3 normal[2];
  for (int side = 0; side < 2; ++side) {
    const Vec3 d = side == 0 ? direction : -direction;
    const RayHit hit = bvh_.first_hit(view_, {p, d, 0, HUGE_VAL});
    if (!hit.valid()) return std::nullopt;
    const double x = field_at(surface_, field_, hit.triangle, hit.barycentric);
    normal[side] = normal_[hit.triangle];
    if ((x > 0) != (side == 0) || dot(normal[side], d) <= kFacing) return std::nullopt;
    (side == 0 ? out.hit.plus : out.hit.minus) = hit.t;
  }
  out.hit.facing = -dot(normal[0], normal[1]);
  out.bisector = normalized(normal[0] - normal[1]);
  return out;
}

std::optional<TwoSidedHit> TwoSidedRays::cast(Vec3 p, Vec3 direction) const {
  const auto first = both(p, direction);
  if (!first) return std::nullopt;
  const auto second = both(p, first->bisector);
  return second ? second->hit : first->hit;
}

}  // namespace kerf::mid
