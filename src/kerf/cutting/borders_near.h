// Borders near a place, as far as the material leads to them.
#pragma once

#include <algorithm>
#include <array>

#include "kerf/base/at.h"
#include "kerf/binding/cell_complex.h"
#include "kerf/cutting/tolerances.h"
#include "kerf/spatial/segment_queries.h"

namespace kerf::cut {

/// Calls fn(h, t, distance) for border edges nearer than `reach` metres to a point of a face, at rest: t is the fraction of the edge nearest to it. Goes
/// from face to face over edges that are as near, kFacesAround at most.
template <class Fn>
void for_each_border_near(const CollisionMesh& mesh, CollisionTriangle face, Vec3 x, double reach, Fn&& fn) {
  std::array<CollisionTriangle, kFacesAround> around{face};
  int faces = 1;
  for (int i = 0; i < faces; ++i)
    for (int k = 0; k < 3; ++k) {
      const CollisionHalfEdge h = CollisionMesh::corner(around[at(i)], k);
      const Vec3 a = mesh.rest[mesh.from(h)], b = mesh.rest[mesh.to(h)];
      const double t = closest_on_segment(x, a, b), distance = norm(lerp(a, b, t) - x);
      if (distance >= reach) continue;
      if (mesh.is_border(h)) {
        fn(h, t, distance);
        continue;
      }
      const CollisionTriangle other = CollisionMesh::face(mesh.twin[h]);
      if (faces < kFacesAround && std::find(around.begin(), around.begin() + faces, other) == around.begin() + faces)
        around[at(faces++)] = other;
    }
}

}  // namespace kerf::cut
