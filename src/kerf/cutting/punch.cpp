#include "kerf/cutting/punch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kerf/base/indexed.h"
#include "kerf/base/journal.h"
#include "kerf/cutting/blade_edge.h"
#include "kerf/cutting/cut_along.h"
#include "kerf/cutting/cut_scratch.h"
#include "kerf/cutting/orient.h"
#include "kerf/cutting/pieces.h"
#include "kerf/cutting/tolerances.h"
#include "kerf/mesh/union_find.h"

namespace kerf {
namespace {

using namespace cut;
using H = CollisionHalfEdge;
using V = CollisionVertex;
using F = CollisionTriangle;

/// Corners of an outline, and how wide it must be at least, in minimum features (2 x area / perimeter: a circle's radius).
constexpr std::size_t kMostCorners = 2000;
constexpr double kLeastRadius = 3;
/// Outlines that met a degenerate case are moved by these parts of the minimum feature.
constexpr double kRetries[] = {0, 0.6, -0.6, 1.3, -1.3, 2.1};
/// A triangle is well inside from this part of the outline's radius (2 x area / perimeter) on.
constexpr double kWellInside = 0.3;

double double_area(const std::vector<Vec2>& p) {
  double sum = 0;
  for (std::size_t i = 0; i < p.size(); ++i) sum += cross(p[i] - p[0], p[(i + 1) % p.size()] - p[0]);
  return sum;
}
double perimeter(const std::vector<Vec2>& p) {
  double sum = 0;
  for (std::size_t i = 0; i < p.size(); ++i) sum += norm(p[(i + 1) % p.size()] - p[i]);
  return sum;
}

bool sides_touch(Vec2 a, Vec2 b, Vec2 c, Vec2 d) {
  const double abc = orient(a, b, c), abd = orient(a, b, d), cda = orient(c, d, a), cdb = orient(c, d, b);
  if (abc == 0 && abd == 0) {
    const Vec2 e = b - a;
    const double s = dot(c - a, e), t = dot(d - a, e);
    return std::max(s, t) >= 0 && std::min(s, t) <= dot(e, e);
  }
  return (abc >= 0) != (abd > 0) && (cda >= 0) != (cdb > 0);
}

Status check_punch(const Punch& punch, double feature) {
  const std::vector<Vec2>& p = punch.outline;
  if (!is_finite(punch.centre) || !is_finite(punch.axis) || !is_finite(punch.across) || !(punch.reach > 0))
    return bad_input("punch: centre, axis and across must be finite numbers, reach above 0");
  if (!(norm(punch.axis) > 0)) return bad_input("punch: the axis has no direction");
  if (!(norm(cross(punch.axis, punch.across)) > 1e-9 * norm(punch.axis) * norm(punch.across)))
    return bad_input("punch: across must not point along the axis");
  if (p.size() < 3 || p.size() > kMostCorners)
    return bad_input(fmt::format("punch: an outline of {} points; give it 3 to {}", p.size(), kMostCorners));
  for (std::size_t i = 0; i < p.size(); ++i)
    if (!std::isfinite(p[i].x) || !std::isfinite(p[i].y))
      return bad_input(fmt::format("punch: point {} of the outline is not finite", i + 1));
  for (std::size_t i = 0; i < p.size(); ++i) {
    const std::size_t j = (i + 1) % p.size();
    if (p[i] == p[j])
      return bad_input(fmt::format("punch: points {} and {} of the outline are the same", i + 1, j + 1));
    for (std::size_t k = i + 2; k < p.size(); ++k)
      if ((k + 1) % p.size() != i && sides_touch(p[i], p[j], p[k], p[(k + 1) % p.size()]))
        return bad_input(
            fmt::format("punch: the outline touches itself: its sides from point {} and from point {}", i + 1, k + 1));
  }
  const double around = perimeter(p), radius = around > 0 ? std::fabs(double_area(p)) / around : 0;
  if (!(radius >= kLeastRadius * feature))
    return bad_input(fmt::format(
        "punch: too small to be cut into this collision mesh; its outline is as wide as a circle of radius {:.3g} m, and "
        "{:.3g} m is the least (or choose a smaller minimum_feature)",
        radius, kLeastRadius * feature));
  return {};
}

/// The plane of the outline.
struct Chart {
  Vec3 origin, x, y, axis;
  [[nodiscard]] Vec2 operator()(Vec3 p) const { return {dot(p - origin, x), dot(p - origin, y)}; }
  [[nodiscard]] double depth(Vec3 p) const { return dot(p - origin, axis); }
  [[nodiscard]] Vec3 place(Vec2 q) const { return origin + q.x * x + q.y * y; }
};

double distance_to_segment(Vec2 p, Vec2 a, Vec2 b) {
  const Vec2 d = b - a;
  const double s = std::clamp(dot(p - a, d) / std::max(dot(d, d), 1e-300), 0.0, 1.0);
  return norm(p - (a + s * d));
}

/// > 0 inside, by the distance to the outline.
double depth_inside(const std::vector<Vec2>& outline, Vec2 p) {
  bool inside = false;
  double nearest = HUGE_VAL;
  for (std::size_t i = 0, j = outline.size() - 1; i < outline.size(); j = i++) {
    const Vec2 a = outline[i], b = outline[j];
    if ((a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y)) inside = !inside;
    nearest = std::min(nearest, distance_to_segment(p, a, b));
  }
  return inside ? nearest : -nearest;
}

/// Connected pieces of the collision mesh, and which of them lie inside an outline.
struct Inside {
  std::vector<std::int32_t> piece;      ///< of every triangle
  std::vector<std::uint8_t> is_inside;  ///< of every piece
  bool hangs_on = false;                ///< within reach, well inside and well outside are connected
};

/// A triangle is well outside farther than `margin` from the outline, well inside nearer to its middle than that.
Inside find_inside(const CellComplex& body, const std::vector<Vec3>& position, const Chart& chart,
                   const std::vector<Vec2>& outline, double reach, double margin) {
  const CollisionMesh& mesh = body.collision;
  Inside result;
  Pieces pieces = collision_pieces(body);
  result.piece = std::move(pieces.of_face);
  const auto n = static_cast<std::size_t>(pieces.count);
  std::vector<std::uint8_t> outside(n, 0), deep_in(mesh.face_count(), 0), far_out(mesh.face_count(), 0);
  result.is_inside.assign(n, 0);
  UnionFind reached(mesh.face_count());
  std::vector<std::uint8_t> is_reached(mesh.face_count(), 0);
  const double well_inside = std::min(margin, kWellInside * std::fabs(double_area(outline)) / perimeter(outline));
  Vec2 low = outline[0], high = outline[0];
  for (const Vec2 q : outline) {
    low = {std::min(low.x, q.x), std::min(low.y, q.y)};
    high = {std::max(high.x, q.x), std::max(high.y, q.y)};
  }
  const auto is_far = [&](const Vec3(&corner)[3]) {  // by boxes
    const Vec2 a = chart(corner[0]), b = chart(corner[1]), c = chart(corner[2]);
    const double far = kPunchFar * margin;
    return std::min({a.x, b.x, c.x}) > high.x + far || std::max({a.x, b.x, c.x}) < low.x - far ||
           std::min({a.y, b.y, c.y}) > high.y + far || std::max({a.y, b.y, c.y}) < low.y - far;
  };
  // Triangles share corners and the middles of edges.
  std::vector<double> at_vertex(mesh.vertex_count(), NAN), at_edge(mesh.half_edge_count(), NAN);
  const auto depth_at_vertex = [&](H h, Vec3 x) {
    double& d = at_vertex[mesh.origin[h].index()];
    return std::isnan(d) ? d = depth_inside(outline, chart(x)) : d;
  };
  const auto depth_at_edge = [&](H h, Vec3 a, Vec3 b) {
    const H t = mesh.twin[h];
    double& d = at_edge[h.index()];
    d = t.valid() ? at_edge[t.index()] : NAN;
    return std::isnan(d) ? d = depth_inside(outline, chart(0.5 * (a + b))) : d;
  };
  for (const F f : ids<F>(mesh.face_count())) {
    Vec3 corner[3];
    for (int i = 0; i < 3; ++i) corner[i] = position[mesh.origin[CollisionMesh::corner(f, i)].index()];
    const auto p = static_cast<std::size_t>(result.piece[f.index()]);
    if (std::any_of(corner, corner + 3, [&](Vec3 x) { return std::fabs(chart.depth(x)) > reach; })) {
      outside[p] = 1;
      continue;
    }
    is_reached[f.index()] = 1;
    for (int i = 0; i < 3; ++i)
      if (const H t = mesh.twin[CollisionMesh::corner(f, i)]; t.valid() && is_reached[CollisionMesh::face(t).index()])
        reached.join(f.value, CollisionMesh::face(t).value);
    if (is_far(corner)) {
      far_out[f.index()] = outside[p] = 1;
      continue;
    }
    const double depth = depth_inside(outline, chart((1.0 / 3) * (corner[0] + corner[1] + corner[2])));
    double least = depth, most = depth;
    for (int i = 0; i < 3; ++i) {
      const H h = CollisionMesh::corner(f, i);
      for (const double d : {depth_at_vertex(h, corner[i]), depth_at_edge(h, corner[i], corner[(i + 1) % 3])}) {
        least = std::min(least, d);
        most = std::max(most, d);
      }
    }
    if (least < -margin) far_out[f.index()] = outside[p] = 1;
    if (depth > well_inside || most > margin) deep_in[f.index()] = 1;
    if (depth > 0) result.is_inside[p] = 1;
  }
  std::vector<std::uint8_t> holds_deep(mesh.face_count(), 0);
  for (const F f : ids<F>(mesh.face_count()))
    if (deep_in[f.index()]) holds_deep[static_cast<std::size_t>(reached.root(f.value))] = 1;
  for (const F f : ids<F>(mesh.face_count()))
    if (far_out[f.index()] && holds_deep[static_cast<std::size_t>(reached.root(f.value))]) result.hangs_on = true;
  for (std::size_t p = 0; p < n; ++p)
    if (outside[p]) result.is_inside[p] = 0;
  return result;
}

/// Corners nearer than the tolerance to the line between their neighbours are left out.
std::vector<Vec2> simplified(const std::vector<Vec2>& outline, double feature) {
  std::vector<Vec2> kept;
  for (const Vec2 p : outline)
    if (kept.empty() || norm(p - kept.back()) >= feature) kept.push_back(p);
  while (kept.size() > 3 && norm(kept.back() - kept.front()) < feature) kept.pop_back();
  return kept.size() >= 3 ? kept : outline;
}

/// Half the angle between two corners, so that both corners and sides stay within `tolerance` of the circle. A chord with the area of its arc
/// has its ends by a third of the square of that angle outside, and its middle by a sixth inside.
double half_angle(double radius, double tolerance) {
  return std::sqrt(3 * std::clamp(tolerance / std::max(radius, 1e-300), kFinestOutline, kCoarsestOutline));
}
/// Of corners that are twice `a` apart on a circle of radius 1, so that the polygon has the circle's area.
double corner_radius(double a) { return std::sqrt(2 * a / std::sin(2 * a)); }

}  // namespace

std::vector<Vec2> circle_outline(double radius, double tolerance) {
  const int n = std::clamp(static_cast<int>(std::ceil(std::numbers::pi / half_angle(radius, tolerance))), 8, 200);
  const double out = radius * corner_radius(std::numbers::pi / n);
  std::vector<Vec2> points;
  for (int i = 0; i < n; ++i) {
    const double a = 2 * std::numbers::pi * (i + 0.5) / n;
    points.push_back({out * std::cos(a), out * std::sin(a)});
  }
  return points;
}

std::vector<Vec2> d_outline(double radius, double tolerance) {
  const int n = std::clamp(static_cast<int>(std::ceil(0.5 * std::numbers::pi / half_angle(radius, tolerance))), 4, 100);
  const double out = radius * corner_radius(0.5 * std::numbers::pi / n);
  std::vector<Vec2> points;
  for (int i = 0; i <= n; ++i) {
    const double a = std::numbers::pi * (static_cast<double>(i) / n - 0.5);
    points.push_back({out * std::max(0.0, std::cos(a)), out * std::sin(a)});
  }
  points.front().x = points.back().x = 0;
  return points;
}

Result<PunchCut> cut_punch(CellComplex& body, std::vector<Vec3>& position, const Punch& punch,
                           const CutOptions& options, CutScratch& scratch) {
  const double feature = std::max(options.minimum_feature, kLeastFeature) * body.mean_root_edge;
  KERF_TRY(check_punch(punch, feature));
  const CollisionMesh& mesh = body.collision;
  KERF_ASSERT(position.size() == mesh.vertex_count());
  Chart chart{punch.centre, {}, {}, normalized(punch.axis)};
  chart.x = normalized(punch.across - dot(punch.across, chart.axis) * chart.axis);
  chart.y = cross(chart.axis, chart.x);
  std::vector<Vec2> outline = simplified(punch.outline, feature);
  if (double_area(outline) < 0) std::reverse(outline.begin(), outline.end());
  const VisualVertex first_new(body.visual.vertex_count());
  const std::size_t old_vertices = mesh.vertex_count(), old_half_edges = mesh.half_edge_count();
  std::vector<std::uint8_t> was_border(old_half_edges, 0);
  for (const H h : ids<H>(old_half_edges)) was_border[h.index()] = mesh.is_border(h) ? 1 : 0;

  // The edge is as long as the body is deep, and no longer than the punch reaches.
  double low = 0, high = 0;
  for (const Vec3& p : position) {
    low = std::max(low, -chart.depth(p) + feature);
    high = std::max(high, chart.depth(p) + feature);
  }
  low = std::min(low, punch.reach);
  high = std::min(high, punch.reach);
  std::vector<BladeEdge> edges;

  JournalMark mark;
  journal_mark(body, mark);
  Error trouble = failed("punch: what is inside the outline still hangs on; move the punch a little");
  for (std::size_t attempt = 0; attempt < std::size(kRetries); ++attempt) {
    if (attempt > 0) {
      journal_rollback(body, mark);
      position.resize(old_vertices);
    }
    // Wider or narrower, and begun at another corner.
    std::vector<Vec2> corners;
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const std::size_t k = (i + attempt * outline.size() / std::size(kRetries)) % outline.size();
      const Vec2 before = outline[(k + outline.size() - 1) % outline.size()], after = outline[(k + 1) % outline.size()];
      const Vec2 d = after - before;
      const Vec2 outwards = norm(d) > 0 ? (1 / norm(d)) * Vec2{d.y, -d.x} : Vec2{};
      corners.push_back(outline[k] + kRetries[attempt] * feature * outwards);
    }
    edges.clear();
    for (std::size_t i = 0; i <= corners.size(); ++i) {
      const Vec3 p = chart.place(corners[i % corners.size()]);
      edges.push_back({p - low * chart.axis, p + high * chart.axis});
    }
    if (!std::all_of(edges.begin(), edges.end(), [](const BladeEdge& edge) { return check_edge(edge).ok(); }))
      return bad_input(fmt::format(
          "punch: a reach of {:.3g} m is too short for an edge there; give it half the depth of what it goes through, or leave it out",
          punch.reach));
    FaceBoxes boxes;
    SweepTarget target{body, position, boxes, scratch, options};
    const SweepReport swept = cut_along(edges, true, target);
    PunchCut cut;
    cut.opened_edges = swept.steps;
    cut.retries = static_cast<int>(attempt);
    cut.first_new = first_new;
    if (cut.opened_edges == 0) {  // vertices where it would have begun are of no use
      journal_rollback(body, mark);
      position.resize(old_vertices);
      cut.surrounds = std::any_of(position.begin(), position.end(), [&](Vec3 p) {
        return std::fabs(chart.depth(p)) <= punch.reach && depth_inside(outline, chart(p)) > 0;
      });
      return cut;
    }
    const double margin = 4 * feature + 2 * options.path_tolerance * body.mean_root_edge;
    const Inside pieces = find_inside(body, position, chart, corners, punch.reach, margin);
    if (pieces.hangs_on) continue;
    const auto is_inside = [&](F f) {
      return pieces.is_inside[static_cast<std::size_t>(pieces.piece[f.index()])] != 0;
    };
    // Loose by this punch: the pieces with a new lip. What stays has the others.
    std::vector<std::uint8_t> loose(pieces.is_inside.size(), 0);
    for (const H h : ids<H>(mesh.half_edge_count())) {
      if (!mesh.is_border(h) || (h.index() < old_half_edges && was_border[h.index()])) continue;
      // Parts of older borders have new ids, too.
      const Vec2 m = 0.5 * (chart(position[mesh.from(h).index()]) + chart(position[mesh.to(h).index()]));
      if (std::fabs(depth_inside(corners, m)) > margin) continue;
      const F f = CollisionMesh::face(h);
      if (is_inside(f)) loose[static_cast<std::size_t>(pieces.piece[f.index()])] = 1;
      else cut.lips.push_back(h);
    }
    for (const F f : ids<F>(mesh.face_count()))
      if (loose[static_cast<std::size_t>(pieces.piece[f.index()])]) cut.loose.push_back(f);
    return cut;
  }
  return trouble;
}

}  // namespace kerf
