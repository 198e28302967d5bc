#include "kerf/binding/parameters_in.h"

namespace kerf {

std::array<double, 3> parameters_in(const CellComplex& complex, VisualHalfEdge corner, CollisionTriangle triangle) {
  const Patch patch = complex.visual.patch[VisualMesh::face(corner)];
  KERF_ASSERT(!patch.is_wall() && patch.root() == complex.collision.root[triangle]);
  Vec2 p = complex.visual.planar[corner];
  if (patch.side() == Side::kMinus) p.y = -p.y;
  const Vec2 a = complex.collision.planar[CollisionMesh::corner(triangle, 0)];
  const Vec2 b = complex.collision.planar[CollisionMesh::corner(triangle, 1)];
  const Vec2 c = complex.collision.planar[CollisionMesh::corner(triangle, 2)];
  const double area = cross(b - a, c - a);
  const double wb = cross(p - a, c - a) / area, wc = cross(b - a, p - a) / area;
  return {1 - wb - wc, wb, wc};
}

}  // namespace kerf
