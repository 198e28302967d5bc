#include "kerf/binding/squash.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "kerf/base/indexed.h"
#include "kerf/binding/tolerances.h"

namespace kerf {
namespace {

using CV = CollisionVertex;
using CH = CollisionHalfEdge;
using CT = CollisionTriangle;

std::size_t at(std::int32_t i) { return static_cast<std::size_t>(i); }

/// A place in a prism: barycentric weights in its triangle, and metres along the normal there.
struct PrismPoint {
  double b = 0, c = 0, height = 0;
  [[nodiscard]] std::array<double, 3> weights() const { return {1 - b - c, b, c}; }
};

/// What is over and under a collision triangle, between the normals of its corners: x = corner + b u + c v + height (normal + b nu + c nv).
struct Prism {
  Vec3 corner, u, v;            // the first corner, edges from it
  Vec3 normal, nu, nv;          // at the first corner, and how those at the others differ
  Vec3 up;                      // of the triangle, unit
  double area = 0;              // twice the triangle's
  std::array<double, 3> height; // of the corners over the opposite edges

  /// Newton's method, from the projection to the plane; that itself where the normals have crossed on their way.
  [[nodiscard]] PrismPoint find(Vec3 x) const {
    const Vec3 d = x - corner;
    PrismPoint p{dot(cross(d, v), up) / area, dot(cross(u, d), up) / area, dot(d, up)};
    const PrismPoint projected = p;
    for (int step = 0; step < kPrismSteps; ++step) {
      const Vec3 along_b = u + p.height * nu, along_c = v + p.height * nv, along_height = normal + (p.b * nu + p.c * nv);
      const Vec3 left = d - (p.b * u + p.c * v) - p.height * along_height;
      if (dot(left, left) < kPrismGoal * area) break;
      const double volume = dot(cross(along_b, along_c), along_height);
      if (!(volume > kPrismLeast * area)) return projected;
      p.b += dot(cross(left, along_c), along_height) / volume;
      p.c += dot(cross(along_b, left), along_height) / volume;
      p.height += dot(cross(along_b, along_c), left) / volume;
    }
    return p;
  }
  [[nodiscard]] Vec3 squashed(const PrismPoint& p) const { return corner + (p.b * u + p.c * v) + (kSquash * p.height) * up; }
};

Prism prism_of(const CollisionMesh& c, CT f, std::span<const Vec3> normals) {
  std::array<CV, 3> k;
  for (int i = 0; i < 3; ++i) k[at(i)] = c.from(CollisionMesh::corner(f, i));
  Prism p;
  p.corner = c.rest[k[0]];
  p.u = c.rest[k[1]] - p.corner;
  p.v = c.rest[k[2]] - p.corner;
  p.normal = normals[k[0].index()];
  p.nu = normals[k[1].index()] - p.normal;
  p.nv = normals[k[2].index()] - p.normal;
  const Vec3 n = cross(p.u, p.v);
  p.area = norm(n);
  p.up = (1 / p.area) * n;
  p.height = {p.area / norm(p.v - p.u), p.area / norm(p.v), p.area / norm(p.u)};
  return p;
}

struct Landing {
  CT face;
  PrismPoint point;
};

/// From prism to prism across the edge that x is farthest out over, to the one that it is least out of.
Landing walk_to(const CollisionMesh& c, std::span<const Prism> prisms, CT from, Vec3 x) {
  std::array<CT, kMostPrisms> tried;
  Landing best{from, {}};
  double least = HUGE_VAL;
  CT face = from;
  for (std::size_t step = 0; step < tried.size() && face.valid(); ++step) {
    tried[step] = face;
    const Prism& prism = prisms[face.index()];
    const PrismPoint point = prism.find(x);
    // In metres: in weights, a small triangle beyond the rim would seem farther than a large one.
    double out = 0, farthest = 0;
    CT next;
    for (int i = 0; i < 3; ++i) {
      const double over = -point.weights()[at(i)] * prism.height[at(i)];
      out = std::max(out, over);
      const CH twin = c.twin[CollisionMesh::corner(face, (i + 1) % 3)];
      if (over <= farthest || !twin.valid()) continue;
      const CT other = CollisionMesh::face(twin);
      if (std::find(tried.begin(), tried.begin() + static_cast<std::ptrdiff_t>(step) + 1, other) != tried.begin() + static_cast<std::ptrdiff_t>(step) + 1) continue;
      farthest = over;
      next = other;
    }
    if (out < least) {
      least = out;
      best = {face, point};
    }
    face = out > 0 ? next : CT{};
  }
  return best;
}

}  // namespace

void squash(SplitSurface& s, const CollisionMesh& c, const BoundVertices& vertices, std::span<const Vec3> normals) {
  WalledSurface& w = s.walled;
  std::vector<Prism> prisms;
  prisms.reserve(c.face_count());
  for (const CT f : ids<CT>(c.face_count())) prisms.push_back(prism_of(c, f, normals));
  s.upright.reserve(w.position.capacity());
  s.upright = w.position;
  // Outwards from the bound vertices: each vertex begins in the prism of the one it is reached from, so that layers of a bent body which come
  // near each other are not mixed up.
  std::vector<CT> prism_at(w.position.size());
  std::vector<std::int32_t> queue;
  queue.reserve(w.position.size());
  const auto reach = [&](std::int32_t v, CT from) {
    if (prism_at[at(v)].valid()) return;
    prism_at[at(v)] = from;
    queue.push_back(v);
  };
  for (const CV v : ids<CV>(c.vertex_count()))
    for (const std::int32_t b : vertices.bound[v.index()]) reach(b, CollisionMesh::face(c.outgoing[v]));
  for (std::size_t i = 0; i < queue.size(); ++i) {
    const std::int32_t v = queue[i];
    const Landing landing = walk_to(c, prisms, prism_at[at(v)], s.upright[at(v)]);
    prism_at[at(v)] = landing.face;
    w.position[at(v)] = prisms[landing.face.index()].squashed(landing.point);
    const std::int32_t start = fan_start(w, v);
    std::int32_t h = start;
    do {
      reach(w.to(h), landing.face);
      h = ccw(w, h);
    } while (h >= 0 && h != start);
  }
}

void unsquash(SplitSurface& s) {
  s.walled.position = std::move(s.upright);
  s.upright.clear();
}

}  // namespace kerf
