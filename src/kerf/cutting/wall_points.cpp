#include "kerf/cutting/wall_points.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kerf/base/indexed.h"
#include "kerf/cutting/half_edge_split.h"

namespace kerf {
namespace {

/// Where v lies in the plane of a patch.
Vec2 planar_in(const VisualMesh& mesh, VisualVertex v, Patch patch) {
  Vec2 p{};
  cut::for_each_corner(mesh, v, [&](VisualHalfEdge h) {
    if (!(mesh.patch[VisualMesh::face(h)] == patch)) return true;
    p = mesh.planar[h];
    return false;
  });
  return p;
}

struct Rail {
  std::vector<double> along;
  std::vector<Vec3> point;
  [[nodiscard]] Vec3 at(double x) const {
    const auto it = std::upper_bound(along.begin(), along.end(), x);
    if (it == along.begin()) return point.front();
    if (it == along.end()) return point.back();
    const auto i = static_cast<std::size_t>(it - along.begin());
    return lerp(point[i - 1], point[i], (x - along[i - 1]) / (along[i] - along[i - 1]));
  }
};

}  // namespace

Vec3 wall_outward(const CollisionMesh& mesh, CollisionHalfEdge h) {
  const CollisionVertex a = mesh.from(h), b = mesh.to(h);
  return normalized(cross(mesh.rest[b] - mesh.rest[a], mesh.offset[a] + mesh.offset[b]));
}

void wall_points(const CellComplex& body, WallId wall, std::vector<WallPoint>& out) {
  out.clear();
  const CollisionMesh& coarse = body.collision;
  const VisualMesh& mesh = body.visual;
  const CollisionHalfEdge h = body.wall_edge[wall];
  const Patch patch = Patch::of_wall(wall);
  const CollisionVertex end[2] = {coarse.from(h), coarse.to(h)};
  Rail rail[2];
  double depth = 0;
  for (std::size_t s = 0; s < 2; ++s) {
    const auto add = [&](VisualVertex v) {
      const Vec2 p = planar_in(mesh, v, patch);
      rail[s].along.push_back(p.x);
      rail[s].point.push_back(mesh.rest[v]);
      if (s == 1) depth = std::max(depth, -p.y);
    };
    add(coarse.bound[end[0]][s]);
    const PoolRun run = coarse.chain[h][s];
    for (std::int32_t i = 0; i < run.count; ++i) add(body.chain_pool[run.at(i)]);
    add(coarse.bound[end[1]][s]);
  }
  if (!(depth > 0)) return;
  const PoolRun inner = body.wall_inner[wall];
  for (std::int32_t i = 0; i < inner.count; ++i) {
    WallPoint w;
    w.vertex = body.wall_pool[inner.at(i)];
    if (!mesh.free[w.vertex]) continue;
    const Vec2 p = planar_in(mesh, w.vertex, patch);
    w.along = p.x;
    w.top = rail[0].at(p.x);
    w.bottom = rail[1].at(p.x);
    w.across = std::clamp(-p.y / depth, 0.0, 1.0);
    w.smooth = lerp(w.top, w.bottom, w.across);
    out.push_back(w);
  }
  // A line that was walked across an older wall has its own depths there, which the wall beyond it does not know: so lines are
  // measured by where they are.
  for (const CollisionVertex e : end) {
    const PoolRun line = coarse.line[e];
    for (std::int32_t i = 0; i < line.count; ++i) {
      WallPoint w;
      w.vertex = body.chain_pool[line.at(i)];
      w.along = planar_in(mesh, w.vertex, patch).x;
      w.top = mesh.rest[coarse.bound[e][0]];
      w.bottom = mesh.rest[coarse.bound[e][1]];
      const Vec3 down = w.bottom - w.top;
      w.across = std::clamp(dot(mesh.rest[w.vertex] - w.top, down) / std::max(dot(down, down), 1e-300), 0.0, 1.0);
      w.smooth = lerp(w.top, w.bottom, w.across);
      w.on_line = true;
      out.push_back(w);
    }
  }
}

std::vector<WallId> bare_walls(const CellComplex& body) {
  const CollisionMesh& mesh = body.collision;
  // Ends of border edges at rest, in one order for both of its sides.
  struct Place {
    std::array<double, 6> ends;
    WallId wall;
  };
  std::vector<Place> places;
  for (const WallId w : ids<WallId>(body.wall_edge.size())) {
    const CollisionHalfEdge h = body.wall_edge[w];
    const Vec3 a = mesh.rest[mesh.from(h)], b = mesh.rest[mesh.to(h)];
    const std::array<double, 3> x{a.x, a.y, a.z}, y{b.x, b.y, b.z};
    const auto& [low, high] = std::minmax(x, y);
    places.push_back({{low[0], low[1], low[2], high[0], high[1], high[2]}, w});
  }
  std::sort(places.begin(), places.end(), [](const Place& p, const Place& q) { return p.ends < q.ends; });
  std::vector<WallId> bare;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const bool faces = (i > 0 && places[i - 1].ends == places[i].ends) ||
                       (i + 1 < places.size() && places[i + 1].ends == places[i].ends);
    if (!faces) bare.push_back(places[i].wall);
  }
  std::sort(bare.begin(), bare.end());
  return bare;
}

double wall_roughness(const CellComplex& body, const std::vector<WallId>& walls) {
  std::vector<WallPoint> points;
  double sum = 0;
  std::size_t n = 0;
  for (const WallId w : walls) {
    wall_points(body, w, points);
    for (const WallPoint& p : points) {
      const Vec3 d = body.visual.rest[p.vertex] - p.smooth;
      sum += dot(d, d);
    }
    n += points.size();
  }
  return n > 0 ? std::sqrt(sum / static_cast<double>(n)) : 0;
}

}  // namespace kerf
