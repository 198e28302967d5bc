#include "kerf/cutting/rest_point.h"

#include <algorithm>
#include <cmath>

#include "kerf/base/at.h"
#include "kerf/cutting/orient.h"
#include "kerf/cutting/tolerances.h"

namespace kerf {
namespace {

using V = CollisionVertex;
using H = CollisionHalfEdge;
using F = CollisionTriangle;

/// Metres that a point lies inside of a face, negative outside.
double depth_in(const CollisionMesh& mesh, F face, Vec2 at) {
  double least = HUGE_VAL;
  for (int k = 0; k < 3; ++k) {
    const Vec2 a = mesh.planar[CollisionMesh::corner(face, k)],
               b = mesh.planar[CollisionMesh::corner(face, (k + 1) % 3)];
    least = std::min(least, cut::orient(a, b, at) / norm(b - a));
  }
  return least;
}

}  // namespace

Vec2 planar_of(const CollisionMesh& mesh, F face, Vec3 rest) {
  const H h = CollisionMesh::corner(face, 0), next = CollisionMesh::corner(face, 1),
          prev = CollisionMesh::corner(face, 2);
  const Vec3 a = mesh.rest[mesh.from(h)], u = mesh.rest[mesh.from(next)] - a, v = mesh.rest[mesh.from(prev)] - a,
             normal = cross(u, v), x = rest - a;
  const double size = dot(normal, normal), s = dot(cross(x, v), normal) / size, t = dot(cross(u, x), normal) / size;
  return mesh.planar[h] + s * (mesh.planar[next] - mesh.planar[h]) + t * (mesh.planar[prev] - mesh.planar[h]);
}

RestPoint rest_point(const CollisionMesh& mesh, const FacePoint& point) {
  RestPoint m{point.face, {}};
  for (int k = 0; k < 3; ++k) m.at = m.at + point.weights[at(k)] * mesh.planar[CollisionMesh::corner(point.face, k)];
  return m;
}

std::array<double, 3> weights_of(const CollisionMesh& mesh, const RestPoint& point) {
  const Vec2 a = mesh.planar[CollisionMesh::corner(point.face, 0)],
             b = mesh.planar[CollisionMesh::corner(point.face, 1)],
             c = mesh.planar[CollisionMesh::corner(point.face, 2)];
  std::array<double, 3> w{std::max(0.0, cut::orient(b, c, point.at)), std::max(0.0, cut::orient(c, a, point.at)),
                          std::max(0.0, cut::orient(a, b, point.at))};
  const double sum = w[0] + w[1] + w[2];
  for (double& x : w) x /= sum;
  return w;
}

Vec3 place_of(const CollisionMesh& mesh, const RestPoint& point, std::span<const Vec3> vertices) {
  const auto w = weights_of(mesh, point);
  Vec3 x;
  for (int k = 0; k < 3; ++k) x += w[at(k)] * vertices[mesh.from(CollisionMesh::corner(point.face, k)).index()];
  return x;
}

bool find_face(const CollisionMesh& mesh, RestPoint& point, V around, double outside) {
  // On an edge, rounding would choose: even the other lip of a slit.
  if ((!around.valid() || has_corner(mesh, point.face, around)) && depth_in(mesh, point.face, point.at) > -outside)
    return true;
  F found;
  double best = -outside;
  const auto look = [&](F f) {
    const double depth = depth_in(mesh, f, point.at);
    if (depth > best) best = depth, found = f;
  };
  const RootId root = mesh.root[point.face];
  if (around.valid())
    mesh.for_each_outgoing(around, [&](H h) {
      if (mesh.root[CollisionMesh::face(h)] == root) look(CollisionMesh::face(h));
      return true;
    });
  if (!found.valid()) {
    std::array<F, cut::kFacesAround> faces{point.face};
    int count = 1;
    for (int i = 0; i < count; ++i) {
      const F face = faces[at(i)];
      look(face);
      for (int k = 0; k < 3; ++k) {
        const H t = mesh.twin[CollisionMesh::corner(face, k)];
        if (!t.valid() || mesh.root[CollisionMesh::face(t)] != root || count == cut::kFacesAround) continue;
        if (std::find(faces.begin(), faces.begin() + count, CollisionMesh::face(t)) == faces.begin() + count)
          faces[at(count++)] = CollisionMesh::face(t);
      }
    }
  }
  if (found.valid()) point.face = found;
  return found.valid();
}

bool has_corner(const CollisionMesh& mesh, F face, V v) {
  for (int k = 0; k < 3; ++k)
    if (mesh.from(CollisionMesh::corner(face, k)) == v) return true;
  return false;
}

NearInFace near_in_face(const CollisionMesh& mesh, const RestPoint& point, double reach, V own) {
  const Vec3 x = place_of(mesh, point, mesh.rest.raw());
  NearInFace near;
  double least = reach;
  for (int k = 0; k < 3; ++k) {
    const V v = mesh.from(CollisionMesh::corner(point.face, k));
    const double far = norm(mesh.rest[v] - x);
    if (far < least && (v == own || !mesh.on_border(v))) least = far, near.corner = v;
  }
  if (near.corner.valid()) {
    near.distance = least;
    return near;
  }
  for (int k = 0; k < 3; ++k) {
    const H h = CollisionMesh::corner(point.face, k);
    if (mesh.is_border(h)) continue;
    const Vec3 a = mesh.rest[mesh.from(h)], d = mesh.rest[mesh.to(h)] - a;
    const double s = dot(x - a, d) / dot(d, d), far = norm(x - a - s * d);
    if (far < least) least = near.distance = far, near.edge = h, near.fraction = s;
  }
  return near;
}

}  // namespace kerf
