#include "kerf/cutting/leaning_cut.h"

#include <array>
#include <cmath>

#include "kerf/cutting/blade_arcs.h"
#include "kerf/cutting/tolerances.h"

namespace kerf {

void find_leaning(const CollisionMesh& mesh, std::span<const Vec3> position, const BladeArc& arc, Vec3 along,
                  LeaningCut& most) {
  if (arc.crossings.empty() || arc.closed) return;
  const auto at = [&](CollisionVertex v) { return position[v.index()]; };
  const auto corners = [&](CollisionTriangle face) {
    const CollisionHalfEdge h = CollisionMesh::corner(face, 0);
    return std::array<CollisionVertex, 3>{mesh.from(h), mesh.to(h), mesh.apex(h)};
  };
  const auto place = [&](const FacePoint& p) {
    const std::array<CollisionVertex, 3> v = corners(p.face);
    return p.weights[0] * at(v[0]) + p.weights[1] * at(v[1]) + p.weights[2] * at(v[2]);
  };
  const Vec3 swept = normalized(cross(along, place(arc.end.point) - place(arc.begin.point)));
  for (const CollisionTriangle face : arc.faces) {
    if (lies_along(mesh, position, face, along, cut::kPathFlat)) continue;
    const std::array<CollisionVertex, 3> v = corners(face);
    const double half = (norm(mesh.offset[v[0]]) + norm(mesh.offset[v[1]]) + norm(mesh.offset[v[2]])) / 3;
    const double sine = std::abs(dot(normalized(cross(at(v[1]) - at(v[0]), at(v[2]) - at(v[0]))), swept));
    const double distance = half * sine / std::sqrt(1 - sine * sine);
    if (distance > most.distance)
      most = {distance, 2 * half, (1.0 / 3) * (mesh.rest[v[0]] + mesh.rest[v[1]] + mesh.rest[v[2]])};
  }
}

}  // namespace kerf
