#include "kerf/cutting/crossings.h"

namespace kerf {

SelfIntersections crossings_of(const CellComplex& body) {
  TriangleMesh mesh;
  for (const Vec3 p : body.visual.rest.raw()) mesh.positions.push_back(p);
  for (const VisualTriangle f : ids<VisualTriangle>(body.visual.face_count())) {
    const auto at = [&](int k) { return VertexId(body.visual.origin[VisualMesh::corner(f, k)].value); };
    mesh.triangles.push_back({at(0), at(1), at(2)});
  }
  return find_self_intersections(mesh, Neighbours::kCount);
}

}  // namespace kerf
