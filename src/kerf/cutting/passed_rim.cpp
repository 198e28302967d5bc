#include "kerf/cutting/passed_rim.h"

namespace kerf {
namespace {

double facing(const CollisionMesh& mesh, std::span<const Vec3> position, CollisionHalfEdge h, Vec3 along) {
  const Vec3 a = position[mesh.from(h).index()];
  return dot(cross(position[mesh.to(h).index()] - a, position[mesh.apex(h).index()] - a), along);
}

}  // namespace

CollisionHalfEdge passed_rim(const CollisionMesh& mesh, std::span<const Vec3> position, CollisionVertex tip,
                             Vec3 along) {
  double strands = 0, others = 0;  // m^2, twice: how much faces turn towards the edge's tip
  mesh.for_each_outgoing(tip, [&](CollisionHalfEdge h) {
    (mesh.is_border(CollisionMesh::next(h)) ? strands : others) += facing(mesh, position, h, along);
    return true;
  });
  if (!(strands * others < 0)) return {};
  CollisionHalfEdge rim;
  double most = 0;
  mesh.for_each_outgoing(tip, [&](CollisionHalfEdge h) {
    const double inside_out = others > 0 ? -facing(mesh, position, h, along) : facing(mesh, position, h, along);
    if (mesh.is_border(CollisionMesh::next(h)) && inside_out > most) most = inside_out, rim = CollisionMesh::next(h);
    return true;
  });
  return rim;
}

}  // namespace kerf
