#include "kerf/cutting/passed_rim.h"

namespace kerf {

CollisionHalfEdge passed_rim(const CollisionMesh& mesh, std::span<const Vec3> position, CollisionVertex tip,
                             const BladeEdge& edge, Vec3 into, double least) {
  const double length = norm(edge.tip - edge.base);
  const Vec3 along = (1 / length) * (edge.tip - edge.base), aside = cross(along, into);
  CollisionHalfEdge passed;
  double most = least;
  mesh.for_each_outgoing(tip, [&](CollisionHalfEdge h) {
    const CollisionHalfEdge rim = CollisionMesh::next(h);
    // A face that has one of the tip's own lips as another side is a corner of that lip.
    if (!mesh.is_border(rim) || mesh.is_border(h) || mesh.is_border(CollisionMesh::next(rim))) return true;
    const Vec3 a = position[mesh.from(rim).index()] - edge.base, b = position[mesh.to(rim).index()] - edge.base;
    const double from = dot(a, aside), to = dot(b, aside);
    if (!(from * to < 0)) return true;
    const Vec3 crossing = lerp(a, b, from / (from - to));
    const double at = dot(crossing, along), behind = -dot(crossing, into);
    if (at >= 0 && at <= length && behind > most) most = behind, passed = rim;
    return true;
  });
  return passed;
}

}  // namespace kerf
