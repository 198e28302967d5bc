#include "kerf/cutting/path_rounding.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kerf/cutting/borders_near.h"
#include "kerf/cutting/tolerances.h"
#include "kerf/spatial/triangle_queries.h"

namespace kerf {

using V = CollisionVertex;
using H = CollisionHalfEdge;
using F = CollisionTriangle;
using Stop = CutStop;

namespace {

void prepend(BladeArc& arc, const std::vector<ArcCrossing>& way) {
  std::vector<F> faces;
  faces.reserve(way.size());
  for (const ArcCrossing& c : way) faces.push_back(CollisionMesh::face(c.near));
  arc.crossings.insert(arc.crossings.begin(), way.begin(), way.end());
  arc.faces.insert(arc.faces.begin(), faces.begin(), faces.end());
}

}  // namespace

PathRounding::PathRounding(const CollisionMesh& mesh, const CutOptions& options, double mean_edge)
    : mesh_(mesh), feature_(std::max(options.minimum_feature, kLeastFeature) * mean_edge),
      near_(cut::kPathNear * feature_), beside_(cut::kBesideReach * feature_),
      short_(cut::kShortCollisionEdge * cut::kLeastCollisionEdge * feature_), outside_(cut::kPathOutside * mean_edge),
      mouth_(cut::kPathMouth * feature_), fan_(cut::kPathFan * feature_) {}

double PathRounding::foot(H h, Vec3 x) const {
  const Vec3 a = rest(mesh_.from(h)), d = rest(mesh_.to(h)) - a;
  return std::clamp(dot(x - a, d) / dot(d, d), 0.0, 1.0);
}
double PathRounding::distance(H h, Vec3 x) const {
  return distance_to_segment(x, rest(mesh_.from(h)), rest(mesh_.to(h)));
}
/// A point of an edge so near to an end may go there.
double PathRounding::snap(H h) const { return is_short(h) ? length(h) : std::min(0.45 * length(h), feature_); }

PathPlace PathRounding::path_place(const Stop& s) const {
  if (s.kind == Stop::Kind::kVertex) return {rest(s), {}, s.vertex};
  return {rest(s), s.kind == Stop::Kind::kInside ? s.point.face : CollisionMesh::face(s.border(mesh_)), {}};
}

Stop PathRounding::on_border(H border, double fraction) const {
  const double far = length(border), least = snap(border);
  if (fraction * far < least || (1 - fraction) * far < least)
    return Stop::at_vertex(fraction < 0.5 ? mesh_.from(border) : mesh_.to(border));
  return Stop::on_edge(mesh_.from(border), mesh_.to(border), fraction);
}

template <class Fn>
void PathRounding::for_each_of_lip(const Stop& stop, Vec3 from, Vec3 to, Fn&& fn) const {
  const H first = stop.border(mesh_);
  if (!first.valid()) return;
  const auto is_near = [&](V v) {
    return (stop.kind == Stop::Kind::kVertex && v == stop.vertex) || distance_to_segment(rest(v), from, to) < near_;
  };
  H h = first;
  fn(h);
  for (int i = 1; i < cut::kSameLip && is_near(mesh_.to(h)); ++i) fn(h = mesh_.fan_start(mesh_.to(h)));
  h = first;
  for (int i = 1; i < cut::kSameLip && is_near(mesh_.from(h)); ++i) fn(h = mesh_.border_into(mesh_.from(h)));
}

template <class Counts>
BorderFoot PathRounding::border_within(F face, Vec3 x, Counts&& counts) const {
  struct Found {
    BorderFoot foot;
    double distance;
  };
  std::array<Found, 3 * cut::kFacesAround> found;
  std::ptrdiff_t count = 0;
  cut::for_each_border_near(mesh_, face, x, near_, [&](H h, double t, double far) {
    if (counts(h, t)) found[static_cast<std::size_t>(count++)] = {{h, t}, far};
  });
  std::stable_sort(found.begin(), found.begin() + count,
                   [](const Found& a, const Found& b) { return a.distance < b.distance; });
  std::vector<ArcCrossing> way;
  for (std::ptrdiff_t i = 0; i < count; ++i)
    if (const BorderFoot& f = found[static_cast<std::size_t>(i)].foot;
        lead_path(mesh_, {x, face, {}}, path_place(on_border(f.border, f.fraction)), outside_, way))
      return f;
  return {};
}

BorderFoot PathRounding::nearest_border(F face, Vec3 x) const {
  return border_within(face, x, [](H, double) { return true; });
}

BorderFoot PathRounding::own_lip(const Stop& start, F face, Vec3 x) const {
  const std::vector<H> own = lip_edges(start, x, 0);
  return border_within(face, x, [&](H h, double) { return std::find(own.begin(), own.end(), h) != own.end(); });
}

std::vector<H> PathRounding::lip_edges(const Stop& start, Vec3 to, double around) const {
  std::vector<H> edges;
  for_each_of_lip(start, rest(start), to, [&](H h) { edges.push_back(h); });
  if (edges.empty()) return edges;
  const H first = edges.front();
  H h = first;
  for (double far = norm(rest(mesh_.to(h)) - to); far < around; far += length(h))
    edges.push_back(h = mesh_.fan_start(mesh_.to(h)));
  h = first;
  for (double far = norm(rest(mesh_.from(h)) - to); far < around; far += length(h))
    edges.push_back(h = mesh_.border_into(mesh_.from(h)));
  return edges;
}

bool PathRounding::same_lip(const Stop& stop, H border, Vec3 from, Vec3 to) const {
  bool same = false;
  for_each_of_lip(stop, from, to, [&](H h) { same |= h == border; });
  return same;
}

void PathRounding::join(ArcEnd& end, BladeArc& arc, bool last, const Stop* start, const BesideBorder& beside,
                        bool in_slit) const {
  if (end.kind == ArcEnd::Kind::kBorder) return;
  const RestPoint p = rest_point(mesh_, end.point);
  const Vec3 x = rest(p);
  const std::vector<H> own = start ? lip_edges(*start, x, in_slit ? mouth_ : 0) : std::vector<H>{};
  const BorderFoot foot = border_within(p.face, x, [&](H h, double t) {
    if (std::find(own.begin(), own.end(), h) != own.end()) return false;
    const Vec3 border = lerp(rest(mesh_.from(h)), rest(mesh_.to(h)), t);
    // No tooth is as thin as an edge that counts as short: what is so near is not beside the path, the path is on it.
    return norm(border - x) < short_ || !beside.is_beside(mesh_, p.face, x, border);
  });
  if (!foot.exists()) return;
  if (last) arc.reverse();
  lead(arc, on_border(foot.border, foot.fraction), x);
  if (last) arc.reverse();
  end.kind = ArcEnd::Kind::kBorder;
  end.border = foot.border;
  end.fraction = foot.fraction;
}
void PathRounding::join_end(BladeArc& arc, const Stop* start, const BesideBorder& beside, bool in_slit) const {
  join(arc.end, arc, true, start, beside, in_slit);
}
void PathRounding::join_begin(BladeArc& arc) const { join(arc.begin, arc, false, nullptr, kNone, false); }

bool PathRounding::lead(BladeArc& arc, const Stop& from, Vec3 x) const {
  std::vector<ArcCrossing> way;
  const PathPlace to{x, arc.faces.front(), {}};
  if (!lead_path(mesh_, path_place(from), to, outside_, way) && !lead_path(mesh_, path_place(from), to, near_, way))
    return false;
  prepend(arc, way);
  return true;
}

void PathRounding::reduce(BladeArc& arc) {
  for (std::size_t i = 0; i + 1 < arc.crossings.size();) {
    if (arc.crossings[i].far != arc.crossings[i + 1].near || arc.crossings[i].near != arc.crossings[i + 1].far) {
      ++i;
      continue;
    }
    const auto k = static_cast<std::ptrdiff_t>(i);
    arc.crossings.erase(arc.crossings.begin() + k, arc.crossings.begin() + k + 2);
    arc.faces.erase(arc.faces.begin() + k + 1, arc.faces.begin() + k + 3);
    if (i > 0) --i;
  }
}

PathRounding::Slid PathRounding::slide(BladeArc& arc, Stop& begin, Vec3 last, const Stop& end) const {
  if (!begin.border(mesh_).valid()) return {};
  const std::size_t n = arc.crossings.size();
  const H end_border = end.exists() ? end.border(mesh_) : H{};
  Stop lip = begin;
  BorderFoot leaves;
  std::size_t left = n;
  Vec3 before = rest(begin);
  for (std::size_t k = 0; k <= n; ++k) {
    const Vec3 x = k < n ? rest(arc.crossings[k]) : last;
    const BorderFoot middle = nearest_border(arc.faces[k], 0.5 * (before + x));
    if (!middle.exists() || !same_lip(lip, middle.border, before, x)) break;
    BorderFoot foot = nearest_border(arc.faces[k], x);
    if (k == n && end_border.valid()) {
      // In a wedge it may end on the other lip, if only the wedge's tip lies between.
      const std::vector<H> tip = lip_edges(lip, rest(lip), norm(x - before) + mouth_);
      foot = std::find(tip.begin(), tip.end(), end_border) != tip.end() ? own_lip(lip, arc.faces[k], x) : BorderFoot{};
      if (!foot.exists()) foot = {end_border, end.fraction};
    }
    if (!foot.exists() || !same_lip(lip, foot.border, before, x)) break;
    if (k == n) {
      if (!end_border.valid()) begin = on_border(foot.border, foot.fraction);
      return {true, last};
    }
    lip = on_border(foot.border, foot.fraction);
    before = x;
    if (is_near(lip, x)) leaves = foot, left = k;
  }
  if (left == n) return {};
  begin = on_border(leaves.border, leaves.fraction);
  const Vec3 x = rest(arc.crossings[left]);
  arc.crossings.erase(arc.crossings.begin(), arc.crossings.begin() + static_cast<std::ptrdiff_t>(left));
  arc.faces.erase(arc.faces.begin(), arc.faces.begin() + static_cast<std::ptrdiff_t>(left));
  lead(arc, begin, x);
  reduce(arc);
  return {false, x};
}

void PathRounding::begin_on_edge(BladeArc& arc, Stop& begin) const {
  if (begin.kind != Stop::Kind::kInside || arc.crossings.empty()) return;
  ArcCrossing& first = arc.crossings[0];
  const Vec3 x = rest(begin);
  const double off = distance(first.near, x);
  if (off >= feature_) return;
  const double nearest = foot(first.near, x), reach = std::sqrt(feature_ * feature_ - off * off) / length(first.near);
  first.fraction = std::clamp(first.fraction, std::max(0.0, nearest - reach), std::min(1.0, nearest + reach));
  const V v = vertex_of_crossing(arc, 0, x);
  if (!v.valid() || norm(rest(v) - x) < feature_) {
    begin = {};
    return;
  }
  // A vertex farther off does not take it.
  begin = on_edge(first);
  arc.crossings.erase(arc.crossings.begin());
  arc.faces.erase(arc.faces.begin());
}

/// Radians, at rest.
double PathRounding::material_around(V v) const {
  double sum = 0;
  mesh_.for_each_outgoing(v, [&](H h) {
    const Vec3 a = normalized(rest(mesh_.to(h)) - rest(v)), b = normalized(rest(mesh_.apex(h)) - rest(v));
    sum += std::acos(std::clamp(dot(a, b), -1.0, 1.0));
    return true;
  });
  return sum;
}

void PathRounding::hold_at_border(BladeArc& arc, RestPoint& goal) const {
  const Vec3 last = rest(goal);
  while (!arc.crossings.empty()) {
    const ArcCrossing& c = arc.crossings.back();
    if (off_end(c) >= snap(c.near) || !mesh_.on_border(near_end(c)) || norm(rest(c) - last) >= feature_) return;
    goal = {CollisionMesh::face(c.near),
            lerp(mesh_.planar[c.near], mesh_.planar[CollisionMesh::next(c.near)], c.fraction)};
    arc.crossings.pop_back();
    arc.faces.pop_back();
  }
}

Stop PathRounding::on_edge(const ArcCrossing& c) const {
  const double least = std::min(0.5, feature_ / length(c.near));
  return Stop::on_edge(mesh_.from(c.far), mesh_.to(c.far), 1 - std::clamp(c.fraction, least, 1 - least));
}

bool PathRounding::may_pass(V v) const { return !mesh_.on_border(v) || material_around(v) > cut::kReflex; }

template <class Fn>
V PathRounding::end_of_short(const ArcCrossing& c, Fn&& is_free) const {
  const V near = near_end(c), far = near == mesh_.from(c.near) ? mesh_.to(c.near) : mesh_.from(c.near);
  for (const V v : {near, far})
    if (may_pass(v) && is_free(v)) return v;
  return is_free(near) ? near : is_free(far) ? far : V{};
}

V PathRounding::vertex_of_crossing(const BladeArc& arc, std::size_t i, Vec3 from, const BesideBorder& beside) const {
  const std::size_t n = arc.crossings.size();
  const ArcCrossing& c = arc.crossings[i];
  const V v = near_end(c);
  const double off = off_end(c);
  const auto ends_at = [&](H h) { return mesh_.from(h) == v || mesh_.to(h) == v; };
  // Crossings of two edges that meet at a vertex, with less than a feature between them; the way back along the path still sees it beside the vertex.
  const auto close = [&](std::size_t k) {
    return k < n && ends_at(arc.crossings[k].near) && norm(rest(c) - rest(arc.crossings[k])) < feature_ &&
           distance_to_segment(rest(v), rest(c), rest(arc.crossings[k])) < near_;
  };
  if (off < snap(c.near) || (off < fan_ && (close(i - 1) || close(i + 1)))) return v;
  // Tips and corners of slits that it passes between two crossings.
  const Vec3 x = rest(c), before = i > 0 ? rest(arc.crossings[i - 1]) : from;
  for (const V u : {v, v == mesh_.from(c.near) ? mesh_.to(c.near) : mesh_.from(c.near)}) {
    const bool passes = distance_to_segment(rest(u), before, x) < feature_ ||
                        (i + 1 < n && distance_to_segment(rest(u), x, rest(arc.crossings[i + 1])) < feature_);
    if (passes && !(rest(u) == from) && mesh_.on_border(u) && may_pass(u) &&
        !beside.is_on(mesh_, arc.faces[i], x, rest(u)))
      return u;
  }
  return {};
}

std::vector<Stop> PathRounding::stops_of(const Stop& begin, const BladeArc& arc, const Stop& end,
                                         const BesideBorder& beside) const {
  std::vector<Stop> stops;
  if (begin.exists()) stops.push_back(begin);
  const auto first = static_cast<std::ptrdiff_t>(stops.size());
  std::size_t n = arc.crossings.size();
  const auto vertex_of = [](const Stop& s) { return s.kind == Stop::Kind::kVertex ? s.vertex : V{}; };
  const auto ends_at = [&](const ArcCrossing& c, V v) {
    return v.valid() && (mesh_.from(c.near) == v || mesh_.to(c.near) == v);
  };
  const auto is_at = [&](const ArcCrossing& c, V v) {
    return is_short(c.near) ? ends_at(c, v) : near_end(c) == v && off_end(c) < snap(c.near);
  };
  const V goal = vertex_of(end), home = vertex_of(begin);
  while (goal.valid() && n > 0 && is_at(arc.crossings[n - 1], goal)) --n;
  V last = home;
  const Vec3 from = begin.exists() ? rest(begin) : rest(rest_point(mesh_, arc.begin.point));
  for (std::size_t i = 0; i < n; ++i) {
    const ArcCrossing& c = arc.crossings[i];
    const auto is_used = [&](V v) {
      return std::any_of(stops.begin() + first, stops.end(), [&](const Stop& s) { return vertex_of(s) == v; });
    };
    if (is_short(c.near)) {
      if (ends_at(c, last)) continue;
      if (const V v = end_of_short(c, [&](V u) { return u != goal && u != home && !is_used(u); }); v.valid()) {
        stops.push_back(Stop::at_vertex(last = v));
        continue;
      }
    }
    if (const V v = vertex_of_crossing(arc, i, from, beside); v.valid() && v != goal) {
      if (v == last) continue;
      if (!is_used(v) && may_pass(v) && !(mesh_.on_border(v) && beside.is_on(mesh_, arc.faces[i], rest(c), rest(v)))) {
        stops.push_back(Stop::at_vertex(last = v));
        continue;
      }
    }
    stops.push_back(on_edge(c));
    last = V{};
  }
  if (end.exists()) stops.push_back(end);
  return stops;
}

}  // namespace kerf
