#include "kerf/binding/rim_normals.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "kerf/base/indexed.h"
#include "kerf/binding/tolerances.h"

namespace kerf {
namespace {

std::size_t at(std::int32_t i) { return static_cast<std::size_t>(i); }

/// Direction of the rim at a border vertex.
Vec3 rim_direction(const CollisionMesh& c, CollisionVertex v) {
  CollisionHalfEdge last;
  c.for_each_outgoing(v, [&](CollisionHalfEdge h) {
    last = h;
    return true;
  });
  const Vec3 to = c.rest[c.to(c.fan_start(v))] - c.rest[v], from = c.rest[v] - c.rest[c.apex(last)];
  return normalized(normalized(to) + normalized(from));
}

/// Sums area vectors of the steep faces around a vertex and of those that they lead to.
class SteepFaces {
 public:
  explicit SteepFaces(const WalledSurface& w) : w_(w), seen_(w.position.size(), 0) {}

  /// Within `reach` metres of vertex `centre`; steep to `normal`.
  Vec3 area(std::int32_t centre, Vec3 normal, double reach) {
    Vec3 sum;
    around_.assign(1, centre);
    seen_[at(centre)] = 1;
    for (std::size_t i = 0; i < around_.size(); ++i) {
      const std::int32_t start = fan_start(w_, around_[i]);
      std::int32_t h = start;
      do {
        const Vec3 face = cross(w_.at(w_.to(h)) - w_.at(w_.from(h)), w_.at(w_.apex(h)) - w_.at(w_.from(h)));
        if (std::fabs(dot(face, normal)) < kSteep * norm(face)) {
          sum += face;
          for (const std::int32_t u : {w_.to(h), w_.apex(h)})
            if (!seen_[at(u)] && norm(w_.at(u) - w_.at(centre)) < reach) {
              seen_[at(u)] = 1;
              around_.push_back(u);
            }
        }
        h = ccw(w_, h);
      } while (h >= 0 && h != start);
    }
    for (const std::int32_t u : around_) seen_[at(u)] = 0;
    return sum;
  }

 private:
  const WalledSurface& w_;
  std::vector<std::uint8_t> seen_;
  std::vector<std::int32_t> around_;
};

}  // namespace

void lean_with_sides(const SplitSurface& s, const CollisionMesh& c, const BoundVertices& vertices, std::span<Vec3> normals) {
  SteepFaces steep(s.walled);
  for (const CollisionVertex v : ids<CollisionVertex>(c.vertex_count())) {
    if (!c.on_border(v)) continue;
    Vec3& n = normals[v.index()];
    // Not by the normals of vertices, which average both sides of a crease, nor by the faces at the vertex alone, which in scans are rough.
    Vec3 outward = steep.area(vertices.bound[v.index()][0], n, kSideReach * vertices.half_thickness[v.index()]);
    // Across the rim only: leaning along it, normals at the two sides of a corner would cross.
    const Vec3 along = rim_direction(c, v);
    outward -= dot(outward, along) * along;
    if (!(norm(outward) > 0)) continue;
    outward = normalized(outward);
    n = normalized(n - std::clamp(dot(n, outward), -kMostLean, kMostLean) * outward);
  }
}

}  // namespace kerf
