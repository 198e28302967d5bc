#include "kerf/contact/walls.h"

#include <algorithm>

#include "kerf/contact/lips.h"
#include "kerf/spatial/segment_queries.h"

namespace kerf {
namespace {

using V = CollisionVertex;
using H = CollisionHalfEdge;
using F = CollisionTriangle;

/// beside_wall() for the walls at a vertex of a rim: of an outer corner the farther one, of an inner corner the nearer.
double beside_rim(const BodyView& body, V v, const BodyPoint& p) {
  const RimVertex& rim = rim_at(body, v);
  if (rim.count == 0) return -HUGE_VAL;
  const BodyPoint wall = vertex_point(body, v);
  const double first = beside_wall(wall, rim.end[0].conormal, p);
  if (rim.count == 1) return first;
  const double second = beside_wall(wall, rim.end[1].conormal, p);
  return dot(rim.end[0].conormal, rim.end[1].along[0]) < 0 ? std::max(first, second) : std::min(first, second);
}

/// How far all that stands over an edge is from the wall over another: beside it along `conormal` or next to that, upright to either end of the first,
/// or over or under it. One direction for all four ends: offsets may turn along an edge, and what is beside at its ends may cross in between.
double apart_from_wall(const BodyPoint& wall_first, const BodyPoint& wall_last, Vec3 conormal, const BodyPoint& first,
                       const BodyPoint& last) {
  const auto along = [&](Vec3 n) {
    const auto nearest = [&](const BodyPoint& p) { return dot(n, p.position) - std::fabs(dot(n, p.offset)); };
    const auto farthest = [&](const BodyPoint& p) { return dot(n, p.position) + std::fabs(dot(n, p.offset)); };
    return std::min(nearest(first), nearest(last)) - std::max(farthest(wall_first), farthest(wall_last));
  };
  double apart = along(conormal);
  for (const BodyPoint* p : {&first, &last, &wall_first, &wall_last}) {
    const double size = dot(p->offset, p->offset);
    if (!(size > 0)) continue;
    const Vec3 up = (1 / std::sqrt(size)) * p->offset;
    apart = std::max({apart, along(up), along(-up)});
    if (p == &first || p == &last) apart = std::max(apart, along(normalized(conormal - dot(conormal, up) * up)));
  }
  return apart;
}

}  // namespace

double beside_walls(const BodyView& body, F f, const BodyPoint& p) {
  double beside = -HUGE_VAL;
  for (int i = 0; i < 3; ++i) {
    const H h = ContactSurface::corner(f, i);
    const V v = body.surface.from(h);
    if (body.surface.cut[h] != 0) {
      const double t = closest_on_segment(p.position, body.position(v), body.position(body.surface.to(h)));
      beside = std::max(beside, beside_wall(edge_point(body, h, t), out_of_rim(body, h), p));
    } else if (body.surface.on_cut[v] != 0) {
      beside = std::max(beside, beside_rim(body, v, p));
    }
  }
  return beside;
}

bool has_walls(const BodyView& body, F f) {
  for (int i = 0; i < 3; ++i) {
    const H h = ContactSurface::corner(f, i);
    const V v = body.surface.from(h);
    if (body.surface.cut[h] != 0 || (body.surface.on_cut[v] != 0 && rim_at(body, v).count > 0)) return true;
  }
  return false;
}

double edge_beside_walls(const BodyView& a, H h, const BodyView& b, H g) {
  const BodyPoint first = vertex_point(a, a.surface.from(h)), last = vertex_point(a, a.surface.to(h));
  if (b.surface.cut[g] != 0)
    return apart_from_wall(vertex_point(b, b.surface.from(g)), vertex_point(b, b.surface.to(g)), out_of_rim(b, g),
                           first, last);
  double beside = -HUGE_VAL;
  for (const V v : {b.surface.from(g), b.surface.to(g)})
    if (b.surface.on_cut[v] != 0) beside = std::max(beside, std::min(beside_rim(b, v, first), beside_rim(b, v, last)));
  return beside;
}

}  // namespace kerf
