#include "kerf/cutting/roughen.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

#include "kerf/base/hash.h"
#include "kerf/base/random.h"
#include "kerf/cutting/half_edge_split.h"
#include "kerf/cutting/wall_points.h"
#include "kerf/cutting/wall_room.h"

namespace kerf {
namespace {

using H = CollisionHalfEdge;
using F = CollisionTriangle;
using VV = VisualVertex;

bool less(Vec3 a, Vec3 b) { return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z; }

/// Sorted places of a vertex's neighbours: two vertices with the same ones lie in the same surface.
void ring_of(const VisualMesh& mesh, VV v, std::vector<Vec3>& ring) {
  ring.clear();
  cut::for_each_corner(mesh, v, [&](VisualHalfEdge h) {
    ring.push_back(mesh.rest[mesh.to(h)]);
    return true;
  });
  std::sort(ring.begin(), ring.end(), less);
}

}  // namespace

void roughen_punch(CellComplex& body, const PunchCut& cut, double amplitude, std::uint64_t seed) {
  const CollisionMesh& mesh = body.collision;
  VisualMesh& fine = body.visual;
  if (!body.closed || !(amplitude > 0) || cut.lips.empty()) return;
  std::vector<BorderSegment> borders;
  std::vector<std::pair<Vec3, VV>> opposite;  // wall vertices of the loose part, by place
  std::vector<WallPoint> points;
  for (const F f : cut.loose)
    for (int i = 0; i < 3; ++i) {
      const H h = CollisionMesh::corner(f, i);
      if (!mesh.is_border(h)) continue;
      borders.push_back({mesh.rest[mesh.from(h)], mesh.rest[mesh.to(h)]});
      if (!mesh.wall[h].valid()) continue;
      wall_points(body, mesh.wall[h], points);
      for (const WallPoint& p : points) opposite.emplace_back(fine.rest[p.vertex], p.vertex);
    }
  const auto before = [](const std::pair<Vec3, VV>& a, const std::pair<Vec3, VV>& b) {
    return less(a.first, b.first) || (!less(b.first, a.first) && a.second < b.second);
  };
  std::sort(opposite.begin(), opposite.end(), before);
  opposite.erase(std::unique(opposite.begin(), opposite.end()), opposite.end());

  // Displacements of the lips' vertices; a vertex of a line gets a share from both walls, and one from both or none.
  struct Stray {
    VV vertex;
    Vec3 way;
    double room = HUGE_VAL;
    int walls = 0, needed = 1;
  };
  std::map<std::int32_t, Stray> strays;
  for (const H lip : cut.lips) {
    if (!mesh.wall[lip].valid()) continue;
    const Vec3 outward = wall_outward(mesh, lip);
    wall_points(body, mesh.wall[lip], points);
    for (const WallPoint& p : points) {
      if (p.vertex < cut.first_new) continue;  // the surface of an earlier cut goes on beside the punch
      Stray& s = strays[p.vertex.value];
      s.vertex = p.vertex;
      s.way += outward;
      s.room =
          std::min(s.room, wall_room(mesh, lip, outward, {foot_on(mesh, lip, p.smooth), p.across, p.on_line}, borders));
      ++s.walls;
      if (p.on_line) s.needed = 2;
    }
  }
  std::vector<std::pair<VV, Vec3>> moves;
  std::vector<Vec3> ring, other_ring;
  for (const auto& [id, s] : strays) {
    if (s.walls != s.needed || !(norm(s.way) > 0.5 * s.walls)) continue;
    const Vec3 place = fine.rest[s.vertex];
    ring_of(fine, s.vertex, ring);
    VV partner;
    for (auto it = std::lower_bound(opposite.begin(), opposite.end(), std::pair{place, VV{}}, before);
         it != opposite.end() && it->first == place && !partner.valid(); ++it) {
      ring_of(fine, it->second, other_ring);
      if (ring == other_ring) partner = it->second;
    }
    if (!partner.valid()) continue;
    Hash hash;
    hash.add(place);
    hash.add(seed);
    Random random(hash.value());
    const double d = random.uniform(0, std::min(amplitude, s.room));
    const Vec3 moved = place + d * normalized(s.way);
    if (!is_finite(moved)) continue;
    moves.emplace_back(s.vertex, moved);
    moves.emplace_back(partner, moved);
  }
  for (const auto& [v, p] : moves) fine.rest.set(v, p);
}

}  // namespace kerf
