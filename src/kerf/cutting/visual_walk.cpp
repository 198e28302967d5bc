#include "kerf/cutting/visual_walk.h"

#include <algorithm>
#include <cmath>

#include "kerf/cutting/orient.h"
#include "kerf/cutting/tolerances.h"

namespace kerf::cut {

namespace {

using H = VisualHalfEdge;

void take_from_free(VisualMesh& mesh, VisualVertex v) {
  if (mesh.free[v]) mesh.free.set(v, 0);
}

bool warp_onto(VisualMesh& mesh, VisualVertex v, Vec2 u, Patch patch, double keep) {
  return warp(mesh, v, std::array<PlanarPoint, 1>{{{patch, u}}}, keep);
}

/// The cotangent of the least angle of a triangle; of one without area, infinity. Twice the area is the same for all three angles.
double sharpness(Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 ab = b - a, ac = c - a, bc = c - b;
  const double area = norm(cross(ab, ac));
  return area > 0 ? std::max({dot(ab, ac), -dot(ab, bc), dot(ac, bc)}) / area : HUGE_VAL;
}

/// Turns an edge of the skin that the way from the opposite corner of its face crosses at fraction f, so that it leads to that corner and is not crossed. Only where
/// a vertex on it would be very near to others, where the faces get fatter than those around that vertex, and where surface and texture stay as they are.
bool turn_crossed_edge(CellComplex& body, H h, double f) {
  VisualMesh& mesh = body.visual;
  const H g = mesh.twin[h], hn = VisualMesh::next(h), hp = VisualMesh::prev(h), gn = VisualMesh::next(g),
          gp = VisualMesh::prev(g);
  const Patch patch = mesh.patch[VisualMesh::face(h)];
  if (patch.is_wall() || !(mesh.patch[VisualMesh::face(g)] == patch)) return false;
  const Vec3 a = mesh.rest[mesh.origin[h]], b = mesh.rest[mesh.origin[hn]], c = mesh.rest[mesh.origin[hp]],
             d = mesh.rest[mesh.origin[gp]];
  const Vec3 m = lerp(a, b, f);
  const double reach = place_reach(body);
  if (std::min(std::min(norm(m - a), norm(m - b)), std::min(norm(m - c), norm(m - d))) > reach) return false;
  const Vec2 ua = mesh.planar[h], ub = mesh.planar[hn], uc = mesh.planar[hp], ud = mesh.planar[gp];
  const double least = kWarpKeepsArea * std::min(orient(ua, ub, uc), orient(ub, ua, ud));
  if (!(orient(ua, ud, uc) > least) || !(orient(ub, uc, ud) > least)) return false;
  // The middle of the quad, where its diagonals meet.
  const Vec3 normal = cross(b - a, c - d);
  const double of_a = dot(cross(d - a, c - a), normal), of_b = dot(cross(c - b, d - b), normal);
  const double of_c = dot(cross(a - c, b - c), normal), of_d = dot(cross(b - d, a - d), normal);
  if (!(of_a > 0) || !(of_b > 0) || !(of_c > 0) || !(of_d > 0)) return false;
  const double on_ab = of_a / (of_a + of_b), on_cd = of_c / (of_c + of_d);
  if (!(norm(lerp(a, b, on_ab) - lerp(c, d, on_cd)) < kFlatness * body.mean_root_edge)) return false;
  if (!(mesh.texture[h] == mesh.texture[gn] && mesh.texture[hn] == mesh.texture[g])) return false;
  const Vec2f t = lerp(mesh.texture[h], mesh.texture[hn], on_ab),
              turned = lerp(mesh.texture[hp], mesh.texture[gp], on_cd);
  if (!(static_cast<float>(norm(Vec2{t.x - turned.x, t.y - turned.y})) < kTextureFlatness)) return false;
  const double split = std::max({sharpness(a, m, c), sharpness(m, b, c), sharpness(b, m, d), sharpness(m, a, d)});
  if (!(std::max(sharpness(a, d, c), sharpness(b, c, d)) < split)) return false;
  if (mesh.find_half_edge(mesh.origin[hp], mesh.origin[gp]).valid() ||
      mesh.find_half_edge(mesh.origin[gp], mesh.origin[hp]).valid())
    return false;
  flip_visual_edge(mesh, h);
  return true;
}

/// The chord's next vertex after `current`, found or made; none after a failure.
VisualVertex step_along_chord(CutContext& cut, VisualVertex current, VisualVertex q, Vec2 goal, Patch patch) {
  VisualMesh& mesh = cut.body.visual;
  H direct, exit;
  bool towards_first = false;
  double oa = 0, ob = 0;
  for_each_corner(mesh, current, [&](H h) {
    if (!(mesh.patch[VisualMesh::face(h)] == patch)) return true;
    const H y = VisualMesh::next(h);
    if (mesh.origin[y] == q) {
      direct = h;
      return false;
    }
    const H last = VisualMesh::prev(h);
    if (mesh.origin[last] == q) {
      direct = last;
      return false;
    }
    if (exit.valid()) return true;  // the wedge is known; only a direct edge could still turn up
    const Vec2 c = mesh.planar[h], a = mesh.planar[y], b = mesh.planar[last];
    const double first = orient(c, a, goal);
    if (first < 0) return true;
    const double second = orient(c, b, goal);
    if (second >= 0) return true;  // a goal exactly along c -> b is met as the first edge of the next face
    if (first == 0 && !(dot(a - c, goal - c) > 0)) return true;
    exit = y;
    oa = first;
    ob = second;
    towards_first = first == 0;
    return true;
  });
  if (direct.valid()) {
    if (mesh.barrier[direct]) {
      cut.fail("the path runs along an existing cut", "visual half-edge", direct.value);
      return {};
    }
    set_barrier(mesh, direct);
    return q;
  }
  if (!exit.valid()) {
    // The goal may lie exactly along the last edge of a fan that ends at a border.
    for_each_corner(mesh, current, [&](H h) {
      if (!(mesh.patch[VisualMesh::face(h)] == patch)) return true;
      const H last = VisualMesh::prev(h);
      const Vec2 c = mesh.planar[h], b = mesh.planar[last];
      if (orient(c, b, goal) == 0 && dot(b - c, goal - c) > 0) {
        direct = last;
        return false;
      }
      return true;
    });
    if (direct.valid() && !mesh.barrier[direct] && mesh.free[mesh.origin[direct]]) {
      const VisualVertex along = mesh.origin[direct];
      set_barrier(mesh, direct);
      take_from_free(mesh, along);
      return along;
    }
    cut.fail("the path leaves its patch", "visual vertex", current.value);
    return {};
  }
  const VisualVertex a = mesh.from(exit), b = mesh.to(exit);
  prefetch_split(mesh, exit);
  // Both edges of `current` in this face are known: to a the one before `exit`, from b the one after it, which after a split leads from
  // the new vertex.
  const auto go_along = [&](H edge, VisualVertex to) -> VisualVertex {
    if (mesh.barrier[edge]) {
      cut.fail("the path runs along an existing cut", "visual vertex", to.value);
      return {};
    }
    set_barrier(mesh, edge);
    take_from_free(mesh, to);
    return to;
  };
  const H to_a = VisualMesh::prev(exit), from_b = VisualMesh::next(exit);
  if (towards_first) {
    if (!mesh.free[a]) {
      cut.fail("the path meets an existing cut", "visual vertex", a.value);
      return {};
    }
    return go_along(to_a, a);
  }
  if (mesh.barrier[exit] || mesh.is_border(exit)) {
    cut.fail("the path is blocked by an existing cut", "visual half-edge", exit.value);
    return {};
  }
  const Vec2 ua = mesh.planar[exit], ub = mesh.planar[VisualMesh::next(exit)];
  double f = oa / (oa - ob);
  Vec2 u = lerp(ua, ub, f);
  const double near = near_enough(cut.body, a, b);
  if (f < near && mesh.free[a] && warp_onto(mesh, a, u, patch, kWarpKeepsArea)) return go_along(to_a, a);
  if (1 - f < near && mesh.free[b] && warp_onto(mesh, b, u, patch, kWarpKeepsArea)) return go_along(from_b, b);
  if (turn_crossed_edge(cut.body, exit, f)) return step_along_chord(cut, current, q, goal, patch);
  if (!edge_split_is_sound(mesh, exit, u, u)) {
    if (mesh.free[a] && warp_onto(mesh, a, u, patch, 0)) return go_along(to_a, a);
    if (mesh.free[b] && warp_onto(mesh, b, u, patch, 0)) return go_along(from_b, b);
    bool sound = false;
    for (int i = 0; i < 40 && !sound; ++i) {  // towards the middle, a billionth first
      f += (0.5 - f) * std::min(0.5, 1e-9 * static_cast<double>(1ll << std::min(i, 29)));
      u = lerp(ua, ub, f);
      sound = edge_split_is_sound(mesh, exit, u, u);
    }
    if (!sound) {
      cut.fail("a visual triangle is too thin to cut", "visual half-edge", exit.value);
      return {};
    }
  }
  const VisualVertex m = split_visual_edge(mesh, exit, f, u, u, place_reach(cut.body));
  return go_along(from_b, m);
}

/// The face of `patch` that holds u, walking straight from vertex `from`; none after a failure.
VisualTriangle locate(CutContext& cut, VisualVertex from, Vec2 u, Patch patch) {
  const VisualMesh& mesh = cut.body.visual;
  H y;
  Vec2 start;
  for_each_corner(mesh, from, [&](H h) {
    if (!(mesh.patch[VisualMesh::face(h)] == patch)) return true;
    const H next = VisualMesh::next(h), prev = VisualMesh::prev(h);
    start = mesh.planar[h];
    if (!(orient(start, mesh.planar[next], u) >= 0 && orient(start, mesh.planar[prev], u) <= 0)) return true;
    if (dot(mesh.planar[next] - start, u - start) <= 0 && dot(mesh.planar[prev] - start, u - start) <= 0) return true;
    y = next;
    return false;
  });
  if (!y.valid()) {
    cut.fail("the new point lies outside its patch", "visual vertex", from.value);
    return {};
  }
  for (std::size_t steps = 0; steps < 2 * mesh.face_count() + 16; ++steps) {
    if (orient(mesh.planar[y], mesh.planar[VisualMesh::next(y)], u) >= 0) return VisualMesh::face(y);
    const H twin = mesh.twin[y];
    if (!twin.valid() || mesh.barrier[y]) {
      cut.fail("the way to the new point is blocked by an existing cut", "visual half-edge", y.value);
      return {};
    }
    // A vertex exactly on the ray counts as left of it.
    const H next = VisualMesh::next(twin), prev = VisualMesh::prev(twin);
    y = orient(start, u, mesh.planar[prev]) >= 0 ? next : prev;
  }
  cut.fail("the new point was not found", "visual vertex", from.value);
  return {};
}

}  // namespace

bool walk_chord(CutContext& cut, VisualVertex p, VisualVertex q, Patch patch) {
  const VisualMesh& mesh = cut.body.visual;
  cut.scratch.path.clear();
  const Vec2 goal = planar_in(mesh, q, patch);
  VisualVertex current = p;
  const std::size_t limit = 2 * mesh.face_count() + 16;
  while (cut.scratch.path.size() < limit) {
    current = step_along_chord(cut, current, q, goal, patch);
    if (!current.valid()) return false;
    if (current == q) return true;
    cut.scratch.path.push_back(current);
  }
  return cut.fail("the path does not end", "visual vertex", p.value);
}

VisualVertex insert_point(CutContext& cut, VisualVertex from, Vec2 u, Patch patch) {
  VisualMesh& mesh = cut.body.visual;
  const VisualTriangle f = locate(cut, from, u, patch);
  if (!f.valid()) return {};
  const H h[3] = {VisualMesh::corner(f, 0), VisualMesh::corner(f, 1), VisualMesh::corner(f, 2)};
  const Vec2 p[3] = {mesh.planar[h[0]], mesh.planar[h[1]], mesh.planar[h[2]]};
  std::array<double, 3> weight{orient(u, p[1], p[2]), orient(p[0], u, p[2]), orient(p[0], p[1], u)};
  const double area = weight[0] + weight[1] + weight[2];
  if (!(area > 0)) {
    cut.fail("a visual triangle has no area", "visual triangle", f.value);
    return {};
  }
  for (double& w : weight) w /= area;
  const double reach = place_reach(cut.body);
  for (std::size_t i = 0; i < 3; ++i) {
    const VisualVertex v = mesh.origin[h[i]];
    if (weight[i] > kNearVertexWeight && norm(u - p[i]) < reach && mesh.free[v] &&
        warp_onto(mesh, v, u, patch, kWarpKeepsArea)) {
      take_from_free(mesh, v);
      return v;
    }
  }
  // Edge i is opposite to corner i - 1, that is, h[i] has the weight of corner i + 2.
  const auto split_edge = [&](std::size_t i, double keep) -> VisualVertex {
    if (mesh.barrier[h[i]] || mesh.is_border(h[i]) || !edge_split_is_sound(mesh, h[i], u, u, keep)) return {};
    const double wa = weight[i], wb = weight[(i + 1) % 3];
    return split_visual_edge(mesh, h[i], wb / (wa + wb), u, u, reach);
  };
  const auto distance = [&](std::size_t i) {
    return weight[(i + 2) % 3] * area / norm(p[(i + 1) % 3] - p[i]);
  };  // metres from edge i
  for (std::size_t i = 0; i < 3; ++i)
    if (weight[(i + 2) % 3] < kNearEdgeWeight && distance(i) < reach)
      if (const VisualVertex m = split_edge(i, kSplitKeepsArea); m.valid()) return m;
  if (orient(u, p[1], p[2]) > 0 && orient(p[0], u, p[2]) > 0 && orient(p[0], p[1], u) > 0)
    return split_visual_face(mesh, f, weight, u, reach);
  for (std::size_t i = 0; i < 3; ++i)
    if (weight[(i + 2) % 3] < kNearEdgeWeight)
      if (const VisualVertex m = split_edge(i, 0); m.valid()) return m;
  for (std::size_t i = 0; i < 3; ++i) {
    const VisualVertex v = mesh.origin[h[i]];
    if (mesh.free[v] && warp_onto(mesh, v, u, patch, 0)) {
      take_from_free(mesh, v);
      return v;
    }
  }
  cut.fail("the new point falls onto an existing cut", "visual triangle", f.value);
  return {};
}

}  // namespace kerf::cut
