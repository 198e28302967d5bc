#include "kerf/session/material_places.h"

#include "kerf/embedding/embedding.h"
#include "kerf/spatial/bvh.h"

namespace kerf {
namespace {

TriangleView view_of(const CollisionMesh& mesh, const std::vector<Vec3>& positions) {
  return {positions, std::span(mesh.origin.raw())};
}

}  // namespace

std::vector<Vec3> places_now(const Session& session, std::span<const Vec3> rest) {
  std::vector<Vec3> now;
  now.reserve(rest.size());
  if (rest.empty()) return now;
  const Body& body = session.body();
  const TriangleView triangles = view_of(body.complex.collision, body.complex.collision.rest.raw());
  const TriangleBvh tree(triangles, rest.size());
  std::vector<Vec3> nodes;
  session.shown_nodes(nodes);
  for (const Vec3 p : rest) {
    if (session.stays_at_rest(p)) {
      now.push_back(p);
      continue;
    }
    const ClosestPoint nearest = tree.closest(triangles, p);
    now.push_back(point_position(body.hex, embed_point(body.hex, CollisionTriangle(nearest.triangle), p), nodes));
  }
  return now;
}

std::vector<MiddlePlace> places_at_rest(Session& session, std::span<const Vec3> now) {
  std::vector<MiddlePlace> places;
  places.reserve(now.size());
  if (now.empty()) return places;
  const CollisionMesh& mesh = session.body().complex.collision;
  const TriangleView triangles = view_of(mesh, session.collision_positions());
  const TriangleBvh tree(triangles, now.size());
  for (const Vec3 p : now) {
    const ClosestPoint nearest = tree.closest(triangles, p);
    MiddlePlace place{{}, nearest.distance};
    for (std::size_t i = 0; i < 3; ++i)
      place.rest +=
          nearest.barycentric[i] *
          mesh.rest[mesh.origin[CollisionMesh::corner(CollisionTriangle(nearest.triangle), static_cast<int>(i))]];
    places.push_back(place);
  }
  return places;
}

}  // namespace kerf
