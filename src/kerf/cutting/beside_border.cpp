#include "kerf/cutting/beside_border.h"

#include <algorithm>
#include <cmath>

#include "kerf/cutting/borders_near.h"
#include "kerf/cutting/tolerances.h"

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
  for (int i = 1; i <= parts && sides != 0; ++i)
    sides &= sides_at(mesh, face, lerp(from, place, static_cast<double>(i) / parts), reach);
}

unsigned BesideBorder::sides_at(const CollisionMesh& mesh, CollisionTriangle face, Vec3 place, double reach) const {
  const Vec3 normal = normal_of(mesh, face);
  unsigned found = 0;
  cut::for_each_border_near(mesh, face, place, reach, [&](CollisionHalfEdge h, double t, double) {
    const Vec3 to = lerp(mesh.rest[mesh.from(h)], mesh.rest[mesh.to(h)], t) - place;
    if (!is_ahead_or_behind(way, to)) found |= side_of(normal, way, to);
  });
  return found;
}

}  // namespace kerf
