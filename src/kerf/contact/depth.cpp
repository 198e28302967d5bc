#include "kerf/contact/depth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "kerf/contact/triangle_foot.h"

namespace kerf {
namespace {

using V = CollisionVertex;
using H = CollisionHalfEdge;
using F = CollisionTriangle;

/// Points on a wall: pieces along and up, and along also where it goes through a prism (rims cross in a point). Newton's steps to a place in a prism, and how far (barycentric)
/// the last one may go.
constexpr int kAlong = 8, kUp = 4, kNewton = 8;
constexpr double kSettled = 1e-6, kLost = 40;  // beyond, it has lost its way

/// Is p = x + l o for a point x of face f, -1 < l < 1?
bool is_in_prism(const SurfaceState& body, F f, Vec3 p) {
  const auto v = body.surface->vertices(f);
  std::array<Vec3, 3> x, o;
  for (std::size_t i = 0; i < 3; ++i) {
    x[i] = body.position[v[i].index()];
    o[i] = body.offset[v[i].index()];
  }
  for (int k = 0; k < 3; ++k) {  // most are not even in its box
    const double a = std::fabs(o[0][k]), b = std::fabs(o[1][k]), c = std::fabs(o[2][k]);
    if (p[k] < std::min({x[0][k] - a, x[1][k] - b, x[2][k] - c}) ||
        p[k] > std::max({x[0][k] + a, x[1][k] + b, x[2][k] + c}))
      return false;
  }
  double u = 1.0 / 3, w = 1.0 / 3, l = 0;
  for (int i = 0; i < kNewton; ++i) {
    const Vec3 a = x[0] + l * o[0], up = (1 - u - w) * o[0] + u * o[1] + w * o[2];
    const Vec3 du = x[1] + l * o[1] - a, dw = x[2] + l * o[2] - a, rest = p - (a + u * du + w * dw);
    const double size = dot(du, cross(dw, up));
    if (size == 0) return false;
    const double step[3] = {dot(rest, cross(dw, up)) / size, dot(du, cross(rest, up)) / size,
                            dot(du, cross(dw, rest)) / size};
    u += step[0], w += step[1], l += step[2];
    if (std::fabs(step[0]) + std::fabs(step[1]) + std::fabs(step[2]) < kSettled)
      return u >= 0 && w >= 0 && u + w <= 1 && std::fabs(l) <= 1;
    if (!(std::fabs(u) + std::fabs(w) + std::fabs(l) < kLost)) return false;
  }
  return false;  // of a crooked prism's box, where no place of the prism is p
}

double squared_wall_distance(const SurfaceState& body, H h, Vec3 p) {
  const V a = body.surface->from(h), b = body.surface->to(h);
  const Vec3 low = lifted_corner(body, a, -1), high = lifted_corner(body, b, 1);
  return std::min(nearest_foot(p, {low, lifted_corner(body, b, -1), high}).square,
                  nearest_foot(p, {low, high, lifted_corner(body, a, 1)}).square);
}

/// How deep p is in the material of `faces`, if deeper than `least`, and its way out; else 0, as where none of `prisms` holds it.
double depth_in(const SurfaceState& body, std::span<const F> prisms, std::span<const F> faces, Vec3 p, double least,
                WayOut& out) {
  const ContactSurface& s = *body.surface;
  if (std::none_of(prisms.begin(), prisms.end(), [&](F f) { return is_in_prism(body, f, p); })) return 0;
  double square = HUGE_VAL;
  const auto offer = [&](double way, H edge, std::int32_t side) {
    if (!(way < square)) return;
    square = way;
    out = {edge, side};
  };
  for (const F f : faces) {
    const auto v = s.vertices(f);
    for (const std::int32_t lift : {-1, 1})
      offer(nearest_foot(
                p, {lifted_corner(body, v[0], lift), lifted_corner(body, v[1], lift), lifted_corner(body, v[2], lift)})
                .square,
            ContactSurface::corner(f, 0), lift);
    for (int i = 0; i < 3; ++i)
      if (const H h = ContactSurface::corner(f, i); !s.twin[h].valid()) offer(squared_wall_distance(body, h, p), h, 0);
    if (!(square > least * least)) return 0;
  }
  return std::sqrt(square);
}

using WallCorners = std::array<Vec3, 4>;

/// Is a wall outside the box of a face's prism, at most `least` under its + or - side, or within `least` of its edges? (Beyond an edge that is no border, what
/// is deep is in the next face.)
bool hardly_meet(const SurfaceState& body, const WallCorners& wall, F f, double least) {
  const auto v = body.surface->vertices(f);
  std::array<Vec3, 3> x, o;
  for (std::size_t i = 0; i < 3; ++i) {
    x[i] = body.position[v[i].index()];
    o[i] = body.offset[v[i].index()];
  }
  for (int k = 0; k < 3; ++k) {
    const double a = std::fabs(o[0][k]), b = std::fabs(o[1][k]), c = std::fabs(o[2][k]);
    const auto [first, last] = std::minmax({wall[0][k], wall[1][k], wall[2][k], wall[3][k]});
    if (last < std::min({x[0][k] - a, x[1][k] - b, x[2][k] - c}) ||
        first > std::max({x[0][k] + a, x[1][k] + b, x[2][k] + c}))
      return true;
  }
  const auto apart = [&](Vec3 n) {
    const double first = std::min({dot(n, wall[0]), dot(n, wall[1]), dot(n, wall[2]), dot(n, wall[3])});
    double last = -HUGE_VAL;
    for (std::size_t i = 0; i < 3; ++i) last = std::max(last, dot(n, x[i]) + std::fabs(dot(n, o[i])));
    return first - last > -least;
  };
  const Vec3 n = normalized(cross(x[1] - x[0], x[2] - x[0]));
  return apart(n) || apart(-n) || apart(normalized(cross(x[1] - x[0], n))) ||
         apart(normalized(cross(x[2] - x[1], n))) || apart(normalized(cross(x[0] - x[2], n)));
}

/// The middle of what a segment has in a face's prism, taken for a piece between planes; negative: nothing.
double middle_in_prism(const SurfaceState& body, F f, Vec3 from, Vec3 to) {
  const auto v = body.surface->vertices(f);
  std::array<Vec3, 3> x, o;
  for (std::size_t i = 0; i < 3; ++i) {
    x[i] = body.position[v[i].index()];
    o[i] = body.offset[v[i].index()];
  }
  double first = 0, last = 1;
  const auto clip = [&](Vec3 outward, Vec3 on) {
    const double a = dot(outward, from - on), b = dot(outward, to - on);
    if (a > 0 && b > 0) last = -1;
    else if (a > 0) first = std::max(first, a / (a - b));
    else if (b > 0) last = std::min(last, a / (a - b));
  };
  const Vec3 n = cross(x[1] - x[0], x[2] - x[0]);
  for (const double side : {1.0, -1.0}) {
    const std::array<Vec3, 3> c{x[0] + side * o[0], x[1] + side * o[1], x[2] + side * o[2]};
    clip(side * cross(c[1] - c[0], c[2] - c[0]), c[0]);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t k = (i + 1) % 3;
    const Vec3 up = o[i] + o[k];
    clip(cross(x[k] - x[i], dot(up, n) < 0 ? -up : up), x[i]);
  }
  return first < last ? 0.5 * (first + last) : -1;
}

/// Faces near a box of points that are neighbours of none of some vertices: all that may hold the points, and what bounds their material.
void find_near_faces(const SurfaceState& body, const Box3& box, std::span<const V> vertices, DepthSearch& search) {
  const ContactSurface& s = *body.surface;
  search.near.clear();
  const TreeBox here{to_corner(box.min), to_corner(box.max)};
  const auto r = static_cast<float>(search.reach + search.boxes.slack + 1e-6 * (norm(box.min) + norm(box.max)));
  search.stack.assign(1, 0);
  while (!search.stack.empty()) {
    const std::uint32_t n = search.stack.back();
    search.stack.pop_back();
    if (!near(search.boxes.box[n], here, r)) continue;
    const SurfaceTreeNode node = s.tree.nodes[n];
    if (node.count == 0) {
      search.stack.push_back(node.first + 1);
      search.stack.push_back(node.first);
      continue;
    }
    s.tree.for_each_triangle(n, [&](F f) {
      const auto c = s.vertices(f);
      const TreeCorner &x = search.boxes.points[c[0].index()], &y = search.boxes.points[c[1].index()],
                       &z = search.boxes.points[c[2].index()];
      if (near(joined(joined({x, x}, {y, y}), {z, z}), here, r)) search.near.push_back(f);
    });
  }
  for (const V v : vertices) {
    const auto may_be = [&](F f) {
      return !are_strangers(s, v, f) && rest_distance(s, v, f) <= neighbour_distance(s, v, f);
    };
    if (std::none_of(search.near.begin(), search.near.end(), may_be)) continue;
    find_neighbours(s, v, search.neighbours);
    std::erase_if(search.near, [&](F f) { return is_neighbour(search.neighbours, f); });
  }
}

}  // namespace

Vec3 place_of(const SurfaceState& body, const SurfacePoint& p) {
  Vec3 x;
  for (std::size_t k = 0; k < 3; ++k)
    if (p.vertex[k].valid()) x += p.weight[k] * lifted_corner(body, p.vertex[k], p.lift);
  return x;
}

void prepare_depths(const SurfaceState& body, DepthSearch& search) {
  if (body.surface->tree.empty()) return;
  refit(body.surface->tree, body.surface->origin.raw(), body.position, search.boxes);
  search.neighbours.vertex = {};  // what it found may have been cut since
  double most = 0;
  for (const Vec3 o : body.offset) most = std::max(most, dot(o, o));
  search.reach = std::sqrt(most);
}

double depth_of(const SurfaceState& body, const SurfacePoint& point, double least, DepthSearch& search) {
  if (body.surface->tree.empty()) return 0;
  const Vec3 p = place_of(body, point);
  Box3 box;
  box.add(p);
  std::size_t vertices = 0;
  while (vertices < 3 && point.vertex[vertices].valid()) ++vertices;
  find_near_faces(body, box, std::span(point.vertex).first(vertices), search);
  WayOut out;
  return depth_in(body, search.near, search.near, p, least, out);
}

void find_deep_walls(const SurfaceState& body, double least, DepthSearch& search) {
  const ContactSurface& s = *body.surface;
  search.deep.clear();
  if (s.tree.empty()) return;
  for (const H h : ids<H>(s.twin.size())) {
    if (s.cut[h] == 0) continue;
    const std::array<V, 2> ends{s.from(h), s.to(h)};
    const WallCorners wall{lifted_corner(body, ends[0], -1), lifted_corner(body, ends[1], -1),
                           lifted_corner(body, ends[1], 1), lifted_corner(body, ends[0], 1)};
    Box3 box;
    for (const Vec3 p : wall) box.add(p);
    find_near_faces(body, box, ends, search);
    const auto rest =
        std::partition(search.near.begin(), search.near.end(), [&](F f) { return !hardly_meet(body, wall, f, least); });
    const std::span<const F> prisms(search.near.begin(), rest);
    if (prisms.empty()) continue;
    for (int k = 0; k <= kUp; ++k) {
      DepthSearch::Deep point;
      point.point.vertex = {ends[0], ends[1], V()};
      point.point.lift = 2 * k / static_cast<double>(kUp) - 1;
      const auto look = [&](double t) {
        point.point.weight = {1 - t, t, 0};
        point.depth = depth_in(body, prisms, search.near, place_of(body, point.point), least, point.out);
        if (point.depth > least) search.deep.push_back(point);
      };
      for (int i = 0; i < kAlong; ++i) look(i / static_cast<double>(kAlong));  // where it ends the next wall begins
      const Vec3 from = lifted_corner(body, ends[0], point.point.lift),
                 to = lifted_corner(body, ends[1], point.point.lift);
      for (const F f : prisms)
        if (const double t = middle_in_prism(body, f, from, to); t > 0) look(t);
    }
  }
}

}  // namespace kerf
