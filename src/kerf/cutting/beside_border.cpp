#include "kerf/cutting/beside_border.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kerf/base/at.h"
#include "kerf/cutting/tolerances.h"
#include "kerf/spatial/triangle_queries.h"

namespace kerf {
namespace {

Vec3 normal_of(const CollisionMesh& mesh, CollisionTriangle face) {
  const CollisionHalfEdge h = CollisionMesh::corner(face, 0);
  const Vec3 a = mesh.rest[mesh.from(h)];
  return cross(mesh.rest[mesh.to(h)] - a, mesh.rest[mesh.apex(h)] - a);
}

unsigned side_of(Vec3 normal, Vec3 way, Vec3 to) {
  const double turn = dot(normal, cross(way, to));
  return turn > 0 ? BesideBorder::kLeft : turn < 0 ? BesideBorder::kRight : 0;
}

bool is_ahead_or_behind(Vec3 way, Vec3 to) { return std::fabs(dot(to, way)) > cut::kBeside * norm(to) * norm(way); }

}  // namespace

unsigned BesideBorder::there() const { return far_ >= cut::kBesideFar ? sides : 0; }

bool BesideBorder::is_on(const CollisionMesh& mesh, CollisionTriangle face, Vec3 place, Vec3 point) const {
  return (there() & side_of(normal_of(mesh, face), way, point - place)) != 0;
}

bool BesideBorder::is_beside(const CollisionMesh& mesh, CollisionTriangle face, Vec3 place, Vec3 point) const {
  return is_on(mesh, face, place, point) && !is_ahead_or_behind(way, point - place);
}

void BesideBorder::come_to(const CollisionMesh& mesh, CollisionTriangle face, Vec3 place, double reach) {
  if (!(norm(place - last_) > 0)) return;
  const Vec3 from = last_;
  way = place - from;
  last_ = place;
  far_ += norm(way) / reach;
  const int parts = std::max(1, static_cast<int>(std::ceil(norm(way) / reach)));
  for (int i = 1; i <= parts && sides != 0; ++i) sides &= sides_at(mesh, face, lerp(from, place, static_cast<double>(i) / parts), reach);
}

unsigned BesideBorder::sides_at(const CollisionMesh& mesh, CollisionTriangle face, Vec3 place, double reach) const {
  const Vec3 normal = normal_of(mesh, face);
  unsigned found = 0;
  std::array<CollisionTriangle, cut::kFacesBeside> around{face};
  int faces = 1;
  for (int i = 0; i < faces; ++i)
    for (int k = 0; k < 3; ++k) {
      const CollisionHalfEdge h = CollisionMesh::corner(around[at(i)], k);
      const Vec3 a = mesh.rest[mesh.from(h)], d = mesh.rest[mesh.to(h)] - a;
      const Vec3 foot = a + std::clamp(dot(place - a, d) / dot(d, d), 0.0, 1.0) * d;
      if (norm(foot - place) >= reach) continue;
      if (mesh.is_border(h)) {
        if (!is_ahead_or_behind(way, foot - place)) found |= side_of(normal, way, foot - place);
        continue;
      }
      const CollisionTriangle other = CollisionMesh::face(mesh.twin[h]);
      if (faces < cut::kFacesBeside && std::find(around.begin(), around.begin() + faces, other) == around.begin() + faces) around[at(faces++)] = other;
    }
  return found;
}

}  // namespace kerf
