#include "kerf/binding/rim_fit.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "kerf/base/at.h"
#include "kerf/base/indexed.h"
#include "kerf/binding/collision_mesh_build.h"
#include "kerf/binding/tolerances.h"

namespace kerf {
namespace {

using CV = CollisionVertex;
using CH = CollisionHalfEdge;
using CT = CollisionTriangle;

double shortest_edge(const CollisionMesh& c, CV v) {
  double shortest = HUGE_VAL;
  c.for_each_outgoing(v, [&](CH h) {
    shortest = std::min(shortest, norm(c.rest[c.to(h)] - c.rest[v]));
    if (!c.ccw(h).valid()) shortest = std::min(shortest, norm(c.rest[c.apex(h)] - c.rest[v]));
    return true;
  });
  return shortest;
}

Vec3 area_vector(const CollisionMesh& c, CT f, std::span<const Vec3> place) {
  const Vec3 p = place[c.from(CollisionMesh::corner(f, 0)).index()];
  return cross(place[c.from(CollisionMesh::corner(f, 1)).index()] - p,
               place[c.from(CollisionMesh::corner(f, 2)).index()] - p);
}

/// Sum of the area vectors of faces that are steep to n and are reached from vertex `start` within `reach` over steep faces.
class SideNormal {
 public:
  explicit SideNormal(const WalledSurface& w) : w_(w), seen_(w.position.size(), -1), added_(w.origin.size() / 3, -1) {}

  Vec3 at_vertex(std::int32_t start, Vec3 n, double reach) {
    ++round_;
    Vec3 sum;
    stack_.assign(1, start);
    seen_[at(start)] = round_;
    const Vec3 centre = w_.at(start);
    while (!stack_.empty()) {
      const std::int32_t v = stack_.back();
      stack_.pop_back();
      const std::int32_t first = w_.outgoing[at(v)];
      std::int32_t h = first;
      do {  // the surface is closed
        const std::int32_t f = h / 3;
        if (added_[at(f)] != round_) {
          added_[at(f)] = round_;
          const Vec3 a = w_.at(w_.from(3 * f)),
                     area = cross(w_.at(w_.from(3 * f + 1)) - a, w_.at(w_.from(3 * f + 2)) - a);
          if (std::fabs(dot(area, n)) < kSteepCosine * norm(area)) {
            sum += area;
            for (std::int32_t k = 3 * f; k < 3 * f + 3; ++k) visit(w_.from(k), centre, reach);
          }
        }
        h = w_.opposite(WalledSurface::prev(h));
      } while (h != first);
    }
    return sum;
  }

 private:
  void visit(std::int32_t v, Vec3 centre, double reach) {
    if (seen_[at(v)] == round_ || norm(w_.at(v) - centre) > reach) return;
    seen_[at(v)] = round_;
    stack_.push_back(v);
  }

  const WalledSurface& w_;
  std::vector<std::int32_t> seen_, added_, stack_;  ///< the round in which a vertex, a face was met
  std::int32_t round_ = 0;
};

}  // namespace

bool stays_upright(Vec3 before, Vec3 after) {
  return dot(before, after) > kLeadShrink * dot(before, before) &&
         dot(before, after) > kLeadTurnCosine * norm(before) * norm(after);
}

Result<std::int64_t> lead_border(CollisionMesh& c, const SplitSurface& s, const BoundVertices& vertices) {
  const std::vector<Vec3> given = c.rest.raw();
  std::vector<Vec3> place = given;
  for (const CV v : ids<CV>(c.vertex_count())) {
    if (!c.on_border(v)) continue;
    const Vec3 rim = s.walled.at(vertices.bound[v.index()][0]);
    if (norm(rim - given[v.index()]) < kLeadReach * shortest_edge(c, v)) place[v.index()] = rim;
  }
  for (bool changed = true; changed;) {
    changed = false;
    for (const CT f : ids<CT>(c.face_count())) {
      const Vec3 before = area_vector(c, f, given), after = area_vector(c, f, place);
      if (stays_upright(before, after)) continue;
      for (int k = 0; k < 3; ++k) {
        const std::size_t v = c.from(CollisionMesh::corner(f, k)).index();
        changed |= !(place[v] == given[v]);
        place[v] = given[v];
      }
    }
  }
  TriangleMesh led;
  std::int64_t count = 0;
  for (const CV v : ids<CV>(c.vertex_count()))
    count += norm(place[v.index()] - given[v.index()]) > kLedNoticeably * shortest_edge(c, v);
  led.positions = IndexedArray<VertexId, Vec3>(std::move(place));
  for (const CT f : ids<CT>(c.face_count())) {
    const auto corner = [&](int k) { return VertexId(c.from(CollisionMesh::corner(f, k)).value); };
    led.triangles.push_back({corner(0), corner(1), corner(2)});
  }
  auto built = build_collision_mesh(led, std::vector<double>(c.vertex_count(), 0));
  if (!built) return built.error();
  c = std::move(*built);
  return count;
}

void lean_border_normals(const CollisionMesh& c, const SplitSurface& s, const BoundVertices& vertices,
                         std::span<Vec3> normals) {
  SideNormal side(s.walled);
  for (const CV v : ids<CV>(c.vertex_count())) {
    if (!c.on_border(v)) continue;
    Vec3& n = normals[v.index()];
    Vec3 outward = side.at_vertex(vertices.bound[v.index()][0], n, kSideReach * vertices.half_thickness[v.index()]);
    CH out = c.fan_start(v), in = out;
    while (c.ccw(in).valid()) in = c.ccw(in);
    const Vec3 along = normalized(c.rest[c.to(out)] - c.rest[c.from(CollisionMesh::prev(in))]);
    outward = normalized(outward - dot(outward, along) * along);
    n = normalized(n - std::clamp(dot(n, outward), -kMostLean, kMostLean) * outward);
  }
}

}  // namespace kerf
