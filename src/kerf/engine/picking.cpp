#include "kerf/engine/picking.h"

#include <algorithm>
#include <cmath>

#include "kerf/base/indexed.h"
#include "kerf/spatial/triangle_queries.h"

namespace kerf {
namespace {

/// Seen edge-on, the skin is not this many half thicknesses before the middle.
constexpr double kMostOblique = 3;

/// From the collision mesh to the skin, metres. An open sheet is drawn without its thickness.
double skin_above(const CollisionMesh& mesh, CollisionVertex v) {
  return mesh.bound[v][1].valid() ? norm(mesh.offset[v]) : 0;
}

/// Parameter in [0, 1] of the point of the segment a b that is nearest to the line.
double nearest_to_line(Vec3 a, Vec3 b, Vec3 origin, Vec3 direction) {
  const auto off_line = [&](Vec3 v) { return v - dot(v, direction) * direction; };
  const Vec3 from = off_line(a - origin), along = off_line(b - a);
  const double square = dot(along, along);
  return square > 0 ? std::clamp(-dot(from, along) / square, 0.0, 1.0) : 0.0;
}

/// `t` and `point` of what goes on as a plane with this normal from `middle`, which lies t metres along the ray.
void go_on(Picked& out, Vec3 normal, Vec3 origin, Vec3 direction, double t) {
  const double towards = -dot(normal, direction), facing = std::abs(towards);
  // How far `middle` lies above the ray, towards the eye along the normal; zero where the ray meets it.
  const double above = (towards < 0 ? -1 : 1) * dot(normal, out.middle - origin - t * direction);
  out.t = std::max(0.0, t - (out.skin + above) / std::max(facing, 1 / kMostOblique));
  out.point = origin + out.t * direction;
}

/// What follows from triangle, barycentric coordinates and `middle`, which lies t metres along the ray.
void complete(const CollisionMesh& mesh, std::span<const Vec3> positions, Vec3 origin, Vec3 direction, double t,
              Picked& out) {
  std::array<Vec3, 3> corner;
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const CollisionVertex v = mesh.origin[CollisionMesh::corner(out.triangle, k)];
    corner[i] = positions[v.index()];
    out.half += out.barycentric[i] * norm(mesh.offset[v]);
    out.skin += out.barycentric[i] * skin_above(mesh, v);
    out.rest += out.barycentric[i] * mesh.rest[v];
  }
  out.normal = normalized(cross(corner[1] - corner[0], corner[2] - corner[0]));
  go_on(out, out.normal, origin, direction, t);
}

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
  out.middle = origin + best.t * direction;
  complete(mesh, positions, origin, direction, best.t, out);
  return out;
}

void go_on(Picked& picked, Vec3 normal, Vec3 origin, Vec3 direction) {
  go_on(picked, normal, origin, direction, dot(picked.middle - origin, direction));
}

std::optional<Picked> pick_near(const CollisionMesh& mesh, std::span<const Vec3> positions, Vec3 origin, Vec3 direction,
                                double near) {
  if (auto hit = pick(mesh, positions, origin, direction); hit || !(near > 0)) return hit;
  double least = near, at = 0;
  CollisionTriangle triangle;
  int corner = 0;
  for (const CollisionTriangle f : ids<CollisionTriangle>(mesh.face_count()))
    for (int k = 0; k < 3; ++k) {
      const CollisionHalfEdge h = CollisionMesh::corner(f, k);
      const Vec3 a = positions[mesh.from(h).index()], b = positions[mesh.to(h).index()];
      const double s = nearest_to_line(a, b, origin, direction);
      const Vec3 from_eye = a + s * (b - a) - origin;
      const double t = dot(from_eye, direction), distance = norm(from_eye - t * direction);
      if (t < 0 || distance >= least) continue;
      least = distance;
      at = s;
      triangle = f;
      corner = k;
    }
  if (!triangle.valid()) return std::nullopt;
  Picked out;
  out.triangle = triangle;
  out.barycentric[static_cast<std::size_t>(corner)] = 1 - at;
  out.barycentric[static_cast<std::size_t>((corner + 1) % 3)] = at;
  const CollisionHalfEdge h = CollisionMesh::corner(triangle, corner);
  out.middle = lerp(positions[mesh.from(h).index()], positions[mesh.to(h).index()], at);
  out.beside = least;
  complete(mesh, positions, origin, direction, dot(out.middle - origin, direction), out);
  return out;
}

Vec3 lie_around(const CollisionMesh& mesh, std::span<const Vec3> positions, Vec3 rest, double reach) {
  Vec3 sum;
  for (const CollisionTriangle f : ids<CollisionTriangle>(mesh.face_count())) {
    const std::array<CollisionVertex, 3> v{mesh.origin[CollisionMesh::corner(f, 0)],
                                           mesh.origin[CollisionMesh::corner(f, 1)],
                                           mesh.origin[CollisionMesh::corner(f, 2)]};
    Box3 box;
    for (const CollisionVertex u : v) box.add(mesh.rest[u]);
    const Vec3 below = box.min - rest, above = rest - box.max;
    if (std::max({below.x, below.y, below.z, above.x, above.y, above.z}) >= reach) continue;
    ClosestPoint nearest;
    closest_point(rest, {mesh.rest[v[0]], mesh.rest[v[1]], mesh.rest[v[2]]}, nearest);
    const double near = 1 - nearest.distance / reach;
    const Vec3 a = positions[v[0].index()];
    if (near > 0) sum += near * cross(positions[v[1].index()] - a, positions[v[2].index()] - a);
  }
  return norm(sum) > 0 ? normalized(sum) : Vec3{};
}

std::vector<RimPlace> rim_near(const CollisionMesh& mesh, std::span<const Vec3> positions, Vec3 origin, Vec3 direction,
                               double reach) {
  std::vector<RimPlace> places;
  for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(mesh.half_edge_count())) {
    if (!mesh.is_border(h)) continue;
    const CollisionVertex v = mesh.from(h), w = mesh.to(h);
    const Vec3 p = positions[v.index()], q = positions[w.index()];
    const Vec3 normal = normalized(cross(q - p, positions[mesh.from(CollisionMesh::prev(h)).index()] - p));
    const Vec3 towards = (dot(normal, p - origin) < 0 ? 1.0 : -1.0) * normal;
    const Vec3 a = p + skin_above(mesh, v) * towards, b = q + skin_above(mesh, w) * towards;
    const Vec3 from_eye = lerp(a, b, nearest_to_line(a, b, origin, direction)) - origin;
    const double t = dot(from_eye, direction);
    const Vec3 across = from_eye - t * direction;
    if (t > 0 && norm(across) < reach * t && norm(across) > 0) places.push_back({norm(across) / t, normalized(across)});
  }
  std::sort(places.begin(), places.end(), [](const RimPlace& a, const RimPlace& b) { return a.off < b.off; });
  return places;
}

}  // namespace kerf
