#include "kerf/geodesic/straighten.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kerf/base/check.h"
#include "kerf/geodesic/tolerances.h"

namespace kerf {
namespace {

double angle_between(Vec2 a, Vec2 b) { return std::atan2(std::fabs(cross(a, b)), dot(a, b)); }
double angle_between(Vec3 a, Vec3 b) { return std::atan2(norm(cross(a, b)), dot(a, b)); }

// Where the apex lies beyond the edge right -> left, seen from the side the path comes from. The unfolded triangle is similar to the
// one in space: no root or quotient waits for the one before, and what the sizes drift apart is rounding of products.
Vec2 unfold_apex(Vec3 right, Vec3 left, Vec3 apex, Vec2 right2, Vec2 left2, double sign) {
  const Vec3 edge = left - right, to_apex = apex - right;
  const Vec2 u = left2 - right2;
  const double square = dot(edge, edge);
  if (!(square > 0) || u == Vec2{}) return right2 + Vec2{norm(to_apex), 0};  // a needle: any direction will do
  const double along = dot(to_apex, edge) / square;
  const double away = sign * norm(cross(edge, to_apex)) / square;
  return {right2.x + (along * u.x + away * u.y), right2.y + (along * u.y - away * u.x)};
}

void unfold(const PathQuery& query, const Strip& strip, Straightener& w) {
  const WalledSurface& m = query.surface;
  const std::size_t n = strip.size();
  w.left.resize(n);
  w.right.resize(n);
  Vec3 right = m.at(m.from(strip[0])), left = m.at(m.to(strip[0]));
  Vec2 r{}, l{norm(left - right), 0};
  w.s = unfold_apex(right, left, m.at(query.s), r, l, -1);
  for (std::size_t i = 0;; ++i) {
    w.left[i] = l;
    w.right[i] = r;
    const std::int32_t g = m.opposite(strip[i]);
    const Vec3 p = m.at(m.apex(g));
    const Vec2 apex = unfold_apex(right, left, p, r, l, 1);
    if (i + 1 == n) {
      w.t = apex;
      return;
    }
    KERF_ASSERT(strip[i + 1] / 3 == g / 3 && strip[i + 1] != g);
    if (strip[i + 1] == WalledSurface::next(g)) {
      l = apex;
      left = p;
    } else {
      r = apex;
      right = p;
    }
  }
}

// A funnel between a convex chain on either side; the apex moves along a chain when the other side passes over it.
struct Funnel {
  Straightener& w;
  Vec2 apex;
  std::size_t left_begin = 0, right_begin = 0;

  void add(bool on_left, Vec2 p, std::int32_t crossing) {
    auto& own = on_left ? w.left_chain : w.right_chain;
    auto& other = on_left ? w.right_chain : w.left_chain;
    const std::size_t own_begin = on_left ? left_begin : right_begin;
    std::size_t& other_begin = on_left ? right_begin : left_begin;
    const double side = on_left ? 1 : -1;
    while (own.size() > own_begin) {
      const Vec2 q = own.back().at, o = own.size() >= own_begin + 2 ? own[own.size() - 2].at : apex;
      if (side * cross(q - o, p - o) > 0) break;
      own.pop_back();
    }
    if (own.size() == own_begin) {
      while (other_begin < other.size() && side * cross(other[other_begin].at - apex, p - apex) < 0) {
        commit(other[other_begin], !on_left);
        ++other_begin;
      }
    }
    own.push_back({p, crossing});
  }
  void commit(const Straightener::FunnelPoint& point, bool on_left) {
    w.bends.push_back({point.at, -1, point.crossing, point.crossing, on_left});
    apex = point.at;
  }
};

// The angle at a bend on the side the strip does not lie on, if it is smaller than pi and the way there is free:
// then `way` holds the crossings that lead around on that side.
bool other_side(const PathQuery& query, const Strip& strip, const Straightener& w, std::size_t bend, Strip& way) {
  const WalledSurface& m = query.surface;
  const Bend& b = w.bends[bend];
  const Vec2 before = bend == 0 ? w.s : w.bends[bend - 1].at;
  const Vec2 after = bend + 1 == w.bends.size() ? w.t : w.bends[bend + 1].at;
  const auto& side = b.left ? w.left : w.right;
  const auto first = static_cast<std::size_t>(b.first), last = static_cast<std::size_t>(b.last);
  const Vec2 corner_before = first == 0 ? w.s : side[first - 1];
  const Vec2 corner_after = last + 1 == strip.size() ? w.t : side[last + 1];

  const double limit = std::numbers::pi - kSwitchAngle;
  double angle = angle_between(before - b.at, corner_before - b.at) + angle_between(corner_after - b.at, after - b.at);
  if (!(angle < limit)) return false;
  const std::int32_t goal = m.opposite(strip[last]) / 3;
  const Vec3 centre = m.at(b.vertex);
  std::int32_t h = b.left ? WalledSurface::next(strip[first]) : WalledSurface::prev(strip[first]);
  way.clear();
  for (;;) {
    if (!query.passable(h)) return false;
    way.push_back(h);
    const std::int32_t g = m.opposite(h);
    if (g / 3 == goal) return true;
    const std::int32_t spoke = b.left ? m.from(g) : m.to(g);
    angle += angle_between(m.at(spoke) - centre, m.at(m.apex(g)) - centre);
    h = b.left ? WalledSurface::next(g) : WalledSurface::prev(g);
    if (!(angle < limit)) return false;
  }
}

// Moves the strip around every bend whose other side is smaller than pi. Bends that share a crossing with one that was
// just moved wait for the next round.
bool move_bends(const PathQuery& query, const Strip& strip, Straightener& w, Strip& moved, Strip& way) {
  moved.clear();
  std::size_t done = 0;
  bool any = false;
  for (std::size_t i = 0; i < w.bends.size(); ++i) {
    const Bend& bend = w.bends[i];
    if (static_cast<std::size_t>(bend.first) < done || !other_side(query, strip, w, i, way)) continue;
    for (; done < static_cast<std::size_t>(bend.first); ++done) append_crossing(query.surface, moved, strip[done]);
    for (std::int32_t h : way) append_crossing(query.surface, moved, h);
    done = static_cast<std::size_t>(bend.last) + 1;
    any = true;
  }
  for (; any && done < strip.size(); ++done) append_crossing(query.surface, moved, strip[done]);
  return any;
}

PathStop crossing_stop(std::int32_t h, double t) { return {-1, h, std::clamp(t, kWallClearance, 1 - kWallClearance)}; }

}  // namespace

void pull_tight(const PathQuery& query, const Strip& strip, Straightener& w) {
  KERF_ASSERT(!strip.empty());
  const WalledSurface& m = query.surface;
  unfold(query, strip, w);
  w.bends.clear();
  w.left_chain.clear();
  w.right_chain.clear();
  Funnel funnel{w, w.s};
  funnel.add(true, w.left[0], 0);
  funnel.add(false, w.right[0], 0);
  for (std::size_t i = 1; i < strip.size(); ++i) {
    const bool left_moved = m.from(strip[i]) == m.from(strip[i - 1]);
    funnel.add(left_moved, left_moved ? w.left[i] : w.right[i], static_cast<std::int32_t>(i));
  }
  funnel.add(true, w.t, static_cast<std::int32_t>(strip.size()));
  for (std::size_t i = funnel.left_begin; i + 1 < w.left_chain.size(); ++i) funnel.commit(w.left_chain[i], true);

  w.length = 0;
  Vec2 last = w.s;
  for (Bend& bend : w.bends) {
    const auto end = [&](std::int32_t crossing) {
      const std::int32_t h = strip[static_cast<std::size_t>(crossing)];
      return bend.left ? m.to(h) : m.from(h);
    };
    bend.vertex = end(bend.first);
    while (static_cast<std::size_t>(bend.last) + 1 < strip.size() && end(bend.last + 1) == bend.vertex) ++bend.last;
    w.length += norm(bend.at - last);
    last = bend.at;
  }
  w.length += norm(w.t - last);
}

void straighten(const PathQuery& query, Strip& strip, Straightener& w) {
  trim_strip(query, strip);
  pull_tight(query, strip, w);
  Strip& moved = w.next_strip;
  for (int round = 0; round < kStraightenRounds; ++round) {
    const double length = w.length;
    if (!move_bends(query, strip, w, moved, w.way)) return;
    trim_strip(query, moved);
    if (!moved.empty()) {
      pull_tight(query, moved, w);
      if (w.length < length * (1 - kStraightenGain)) {
        strip.swap(moved);
        continue;
      }
    }
    pull_tight(query, strip, w);
    return;
  }
}

void write_stops(const PathQuery& query, const Strip& strip, const Straightener& w, SurfacePath& path) {
  const WalledSurface& m = query.surface;
  path.stops.clear();
  path.length = w.length;
  path.stops.push_back({query.s, -1, 0});
  std::int32_t through = -1;  // the vertex stop that later crossings may still touch
  const auto touches = [&](std::int32_t h, std::int32_t v) { return m.from(h) == v || m.to(h) == v; };
  const auto pass_through = [&](std::int32_t v) {
    while (path.stops.back().half_edge >= 0 && touches(path.stops.back().half_edge, v)) path.stops.pop_back();
    path.stops.push_back({v, -1, 0});
    through = v;
  };

  std::size_t bend = 0;  // the next bend, or the one whose crossings are being passed
  for (std::size_t i = 0; i < strip.size(); ++i) {
    const std::int32_t h = strip[i], crossing = static_cast<std::int32_t>(i);
    while (bend < w.bends.size() && w.bends[bend].last < crossing) ++bend;
    if (through >= 0 && touches(h, through)) continue;
    through = -1;
    const auto passing = [&](std::size_t k) { return k < w.bends.size() && w.bends[k].first <= crossing; };
    if (passing(bend)) {
      const Bend& b = w.bends[bend];
      if (query.free(b.vertex)) pass_through(b.vertex);
      else if (passing(bend + 1) && w.bends[bend + 1].left != b.left)
        path.stops.push_back(crossing_stop(h, 0.5));  // the path runs along this edge, between two wall vertices
      else path.stops.push_back(crossing_stop(h, b.left ? 1 : 0));
      continue;
    }
    const Vec2 p = bend == 0 ? w.s : w.bends[bend - 1].at, q = bend == w.bends.size() ? w.t : w.bends[bend].at;
    const double r = cross(q - p, w.right[i] - p), l = cross(q - p, w.left[i] - p);
    double t = r / (r - l);
    if (!(t >= 0)) t = std::isnan(t) ? 0.5 : 0;
    if (t > 1) t = 1;
    if (t < kThroughVertex && query.free(m.from(h))) pass_through(m.from(h));
    else if (t > 1 - kThroughVertex && query.free(m.to(h))) pass_through(m.to(h));
    else path.stops.push_back(crossing_stop(h, t));
  }
  path.stops.push_back({query.t, -1, 0});
}

}  // namespace kerf
