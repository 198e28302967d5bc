#include "kerf/cutting/small_piece.h"

#include <cmath>

#include "kerf/cutting/crumb.h"
#include "kerf/cutting/tolerances.h"

namespace kerf {
namespace {

/// m^3 between both sides of the body over one face, by its offsets alone.
double prism_volume(const CollisionMesh& mesh, CollisionTriangle f) {
  const CollisionHalfEdge h = CollisionMesh::corner(f, 0);
  const CollisionVertex a = mesh.from(h), b = mesh.to(h), c = mesh.apex(h);
  const Vec3 area = 0.5 * cross(mesh.rest[b] - mesh.rest[a], mesh.rest[c] - mesh.rest[a]);
  return 2.0 / 3 * std::fabs(dot(area, mesh.offset[a] + mesh.offset[b] + mesh.offset[c]));
}

}  // namespace

std::vector<SmallPiece> small_pieces(const CellComplex& body, std::span<const CollisionTriangle> faces, double most,
                                     CutScratch& scratch) {
  std::vector<SmallPiece> found;
  if (!body.closed || !(most > 0)) return found;
  const CollisionMesh& mesh = body.collision;
  DenseIndex& seen = scratch.crumb_seen;
  std::vector<std::vector<CollisionTriangle>> candidates;
  std::vector<CollisionTriangle>& piece = scratch.crumb_faces;
  seen.reset(mesh.face_count());
  std::int32_t known = 0;  // so many faces were seen before this seed
  for (const CollisionTriangle seed : faces) {
    if (seen.find(seed.value) >= 0) continue;
    const std::int32_t first = known;
    const auto reach = [&](CollisionTriangle f) {
      seen.insert(f.value);
      piece.push_back(f);
      ++known;
    };
    piece.clear();
    reach(seed);
    double prisms = 0;
    bool small = true;
    for (std::size_t i = 0; small && i < piece.size(); ++i) {
      prisms += prism_volume(mesh, piece[i]);
      small = prisms <= cut::kDustPrisms * most;
      for (int k = 0; small && k < 3; ++k) {
        const CollisionHalfEdge t = mesh.twin[CollisionMesh::corner(piece[i], k)];
        if (!t.valid()) continue;
        const std::int32_t number = seen.find(CollisionMesh::face(t).value);
        if (number < 0) reach(CollisionMesh::face(t));
        else small = number >= first;  // small pieces have been seen whole, so this is a part of a larger one
      }
    }
    if (small) candidates.push_back(piece);
  }
  for (std::vector<CollisionTriangle>& triangles : candidates)
    if (const double volume = enclosed_by(body, triangles.front(), scratch); volume < most)
      found.push_back({std::move(triangles), volume});
  return found;
}

}  // namespace kerf
