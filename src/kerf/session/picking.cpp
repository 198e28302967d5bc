#include "kerf/session/picking.h"

#include <algorithm>
#include <cmath>

#include "kerf/base/indexed.h"
#include "kerf/spatial/triangle_queries.h"

namespace kerf {
namespace {

/// Seen edge-on, the skin is not this many half thicknesses before the middle.
constexpr double kMostOblique = 3;

}  // namespace

std::optional<Picked> pick(const CollisionMesh& mesh, std::span<const Vec3> positions, Vec3 origin, Vec3 direction) {
  const Ray ray{origin, direction};
  const RayFrame frame(ray);
  RayHit best;
  for (const CollisionTriangle f : ids<CollisionTriangle>(mesh.face_count())) {
    const auto at = [&](int k) { return positions[mesh.origin[CollisionMesh::corner(f, k)].index()]; };
    RayHit hit;
    if (!intersect(frame, {at(0), at(1), at(2)}, hit) || hit.t < 0 || hit.t >= best.t) continue;
    best = hit;
    best.triangle = f.value;
  }
  if (!best.valid()) return std::nullopt;
  Picked out;
  out.triangle = CollisionTriangle(best.triangle);
  out.barycentric = best.barycentric;
  double half = 0;
  std::array<Vec3, 3> corner;
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const CollisionVertex v = mesh.origin[CollisionMesh::corner(out.triangle, k)];
    corner[i] = positions[v.index()];
    half += best.barycentric[i] * norm(mesh.offset[v]);
    out.rest += best.barycentric[i] * mesh.rest[v];
  }
  out.normal = normalized(cross(corner[1] - corner[0], corner[2] - corner[0]));
  out.middle = origin + best.t * direction;
  const double facing = std::abs(dot(out.normal, direction));
  out.t = std::max(0.0, best.t - half / std::max(facing, 1 / kMostOblique));
  out.point = origin + out.t * direction;
  return out;
}

}  // namespace kerf
