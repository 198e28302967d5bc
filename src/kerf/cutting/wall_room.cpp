#include "kerf/cutting/wall_room.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kerf/cutting/tolerances.h"
#include "kerf/spatial/segment_queries.h"

namespace kerf {
namespace {

/// Distance from p to the part of a segment that lies in front of it.
double distance_in_front(Vec3 p, Vec3 outward, const BorderSegment& s) {
  double nearest = HUGE_VAL;
  for (const Vec3 q : {lerp(s.a, s.b, closest_on_segment(p, s.a, s.b)), s.a, s.b, lerp(s.a, s.b, 0.5)}) {
    const double distance = norm(q - p);
    if (dot(q - p, outward) > cut::kInFront * distance) nearest = std::min(nearest, distance);
  }
  return nearest;
}

}  // namespace

Vec3 foot_on(const CollisionMesh& mesh, CollisionHalfEdge border, Vec3 place) {
  const Vec3 a = mesh.rest[mesh.from(border)], b = mesh.rest[mesh.to(border)];
  return lerp(a, b, closest_on_segment(place, a, b));
}

double wall_room(const CollisionMesh& mesh, CollisionHalfEdge lip, Vec3 outward, const WallPlace& place,
                 std::span<const BorderSegment> borders) {
  const std::array<Vec3, 2> ends = {mesh.rest[mesh.from(lip)], mesh.rest[mesh.to(lip)]};
  const Vec3 along = normalized(ends[1] - ends[0]);
  double room = HUGE_VAL;
  for (const BorderSegment& s : borders) {
    bool beside = false;
    for (std::size_t e = 0; e < 2; ++e)
      if (s.a == ends[e] || s.b == ends[e]) {
        beside = true;
        // The other border goes on from this corner; where it turns towards the material, walls must not meet.
        const Vec3 away = normalized((s.a == ends[e] ? s.b : s.a) - ends[e]);
        const Vec3 back = e == 0 ? along : -along;
        const double c = std::clamp(dot(away, back), -1.0, 1.0);
        if (dot(away, outward) > 0 && !place.on_line)
          room = std::min(
              room, cut::kMostOfTheCorner * norm(place.foot - ends[e]) * std::sqrt((1 - c) / std::max(1 + c, 1e-12)));
      }
    if (!beside)
      room = std::min(room, std::min(cut::kMostOfTheWay, cut::kNearTheSkin * (1 - std::fabs(2 * place.across - 1))) *
                                distance_in_front(place.foot, outward, s));
  }
  return room;
}

}  // namespace kerf
