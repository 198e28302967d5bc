#include "kerf/cutting/passed_rim.h"

namespace kerf {

PassedRim passed_rim(const CollisionMesh& mesh, std::span<const Vec3> position, CollisionVertex tip,
                     const PassingEdge& passing) {
  const BladeEdge& edge = passing.edge;
  const double length = norm(edge.tip - edge.base);
  const Vec3 along = (1 / length) * (edge.tip - edge.base), aside = cross(along, passing.into);
  PassedRim passed;
  double most = passing.least;
  const auto after = [&](CollisionVertex v) { return mesh.to(mesh.fan_start(v)); };
  const auto before = [&](CollisionVertex v) { return mesh.from(mesh.border_into(v)); };
  // The way of the path at the tip, at rest.
  const Vec3 path =
      mesh.on_border(tip) ? mesh.rest[tip] - 0.5 * (mesh.rest[after(tip)] + mesh.rest[before(tip)]) : Vec3{};
  const auto look_across = [&](CollisionVertex v) {
    mesh.for_each_outgoing(v, [&](CollisionHalfEdge h) {
      const CollisionHalfEdge rim = CollisionMesh::next(h);
      // A face that has one of the lips as another side is a corner of that lip; from beside the tip the other lip may be across.
      if (!mesh.is_border(rim) || mesh.is_border(h) || mesh.is_border(CollisionMesh::next(rim))) return true;
      if (v != tip && mesh.is_lip(rim)) return true;
      const Vec3 a = position[mesh.from(rim).index()] - edge.base, b = position[mesh.to(rim).index()] - edge.base;
      const double from = dot(a, aside), to = dot(b, aside);
      if (!(from * to < 0)) return true;
      const double fraction = from / (from - to);
      const Vec3 crossing = lerp(a, b, fraction),
                 there = lerp(mesh.rest[mesh.from(rim)], mesh.rest[mesh.to(rim)], fraction);
      if (dot(there - mesh.rest[tip], path) < 0) return true;
      const double at = dot(crossing, along), behind = -dot(crossing, passing.into);
      if (at >= 0 && at <= length && behind > most) most = behind, passed = {v, rim};
      return true;
    });
  };
  look_across(tip);
  if (!mesh.on_border(tip)) return passed;
  const auto is_beside = [&](CollisionVertex v) {
    return v != tip && !mesh.on_rim(v) && norm(mesh.rest[v] - mesh.rest[tip]) < passing.around;
  };
  for (CollisionVertex v = after(tip); is_beside(v); v = after(v)) look_across(v);
  for (CollisionVertex v = before(tip); is_beside(v); v = before(v)) look_across(v);
  return passed;
}

}  // namespace kerf
