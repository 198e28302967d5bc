#include "kerf/geodesic/strip.h"

#include <algorithm>

#include "kerf/base/check.h"
#include "kerf/geodesic/tolerances.h"

namespace kerf {
namespace {

bool touches(const WalledSurface& m, std::int32_t h, std::int32_t v) { return m.from(h) == v || m.to(h) == v; }

Vec3 vertex_normal(const WalledSurface& m, std::int32_t v) {
  Vec3 sum;
  for_each_in_sector(m, v, {}, [&](std::int32_t h) {
    sum += cross(m.at(m.to(h)) - m.at(v), m.at(m.apex(h)) - m.at(v));
    return true;
  });
  return normalized(sum);
}

}  // namespace

void trim_strip(const PathQuery& query, Strip& strip) {
  const WalledSurface& m = query.surface;
  std::size_t begin = 0, end = strip.size();
  while (begin < end && touches(m, strip[begin], query.s)) ++begin;
  while (begin < end && touches(m, strip[end - 1], query.t)) --end;
  strip.resize(end);
  strip.erase(strip.begin(), strip.begin() + static_cast<std::ptrdiff_t>(begin));
}

bool remove_loops(const WalledSurface& m, Strip& strip, SparseIndex& faces) {
  if (strip.empty()) return false;
  const std::size_t before = strip.size();
  faces.clear();
  for (std::int32_t h : strip) faces.insert(h / 3);
  faces.insert(m.opposite(strip.back()) / 3);
  if (static_cast<std::size_t>(faces.size()) == before + 1) return false;
  if (strip.front() / 3 == m.opposite(strip.back()) / 3) return false;  // nothing would be left

  // Rare, so the simple way: keep the strip built so far, and cut it back to an earlier visit.
  Strip out;
  for (std::int32_t h : strip) {
    for (std::size_t i = 0; i < out.size(); ++i)
      if (out[i] / 3 == h / 3) {
        out.resize(i);
        break;
      }
    append_crossing(m, out, h);
  }
  const std::int32_t last_face = m.opposite(strip.back()) / 3;
  for (std::size_t i = 0; i < out.size(); ++i)
    if (out[i] / 3 == last_face) {
      out.resize(i);
      break;
    }
  strip.swap(out);
  return true;
}

bool cut_strip_by_plane(const PathQuery& query, Strip& strip) {
  const WalledSurface& m = query.surface;
  const Vec3 origin = m.at(query.s), forward = m.at(query.t) - origin;
  const Vec3 normal = vertex_normal(m, query.s) + vertex_normal(m, query.t);
  const Vec3 left = normalized(cross(normal, forward));
  const auto side = [&](std::int32_t v) { return dot(left, m.at(v) - origin); };
  const double longest = kPlaneCutDetour * norm(forward);
  strip.clear();
  if (!(norm(left) > 0)) return false;

  // Leaves s between a corner on the right and one on the left; a folded surface can offer several such faces.
  std::int32_t start = -1;
  double best = 0;
  for_each_in_sector(m, query.s, query.at_s, [&](std::int32_t h) {
    const std::int32_t e = WalledSurface::next(h);
    const double r = side(m.from(e)), l = side(m.to(e));
    if (r < 0 && l >= 0) {
      const double ahead = dot(normalized(lerp(m.at(m.from(e)), m.at(m.to(e)), r / (r - l)) - origin), forward);
      if (start < 0 || ahead > best) start = e, best = ahead;
    }
    return true;
  });
  if (start < 0 || !(best > 0)) return false;

  double right_side = side(m.from(start)), left_side = side(m.to(start)), length = 0;
  Vec3 last = origin;
  std::size_t budget = m.origin.size();
  for (std::int32_t e = start; budget-- > 0;) {
    if (!query.passable(e)) return false;
    strip.push_back(e);
    const Vec3 here = lerp(m.at(m.from(e)), m.at(m.to(e)), right_side / (right_side - left_side));
    length += norm(here - last);
    if (!(length <= longest)) return false;
    last = here;
    const std::int32_t g = m.opposite(e), apex = m.apex(g);
    if (apex == query.t) return query.in_sector(query.t, query.at_t, WalledSurface::prev(g));
    if (apex == query.s) return false;
    const double d = side(apex);
    if (d >= 0) {
      e = WalledSurface::next(g);
      left_side = d;
    } else {
      e = WalledSurface::prev(g);
      right_side = d;
    }
  }
  return false;
}

bool search_corridor(const PathQuery& query, Strip& strip, CorridorSearch& scratch) {
  const WalledSurface& m = query.surface;
  const Vec3 target = m.at(query.t);
  scratch.index.clear();
  scratch.edges.clear();
  scratch.heap.clear();
  strip.clear();
  using Entry = CorridorSearch::Entry;
  const auto later = [](const Entry& a, const Entry& b) {
    return a.estimate != b.estimate ? a.estimate > b.estimate : a.edge > b.edge;
  };
  const auto offer = [&](std::int32_t h, std::int32_t parent, Vec3 from, double so_far) {
    if (!query.passable(h)) return;
    const std::int32_t known = scratch.index.size();
    const std::int32_t number = scratch.index.insert(std::min(h, m.opposite(h)));
    if (number == known)
      scratch.edges.push_back({h, parent, HUGE_VAL, lerp(m.at(m.from(h)), m.at(m.to(h)), 0.5), false});
    CorridorSearch::Edge& edge = scratch.edges[static_cast<std::size_t>(number)];
    const double length = so_far + norm(edge.middle - from);
    if (edge.settled || !(length < edge.length)) return;
    edge.half_edge = h;
    edge.parent = parent;
    edge.length = length;
    scratch.heap.push_back({length + kCorridorGreed * norm(edge.middle - target), number});
    std::push_heap(scratch.heap.begin(), scratch.heap.end(), later);
  };

  for_each_in_sector(m, query.s, query.at_s, [&](std::int32_t h) {
    offer(WalledSurface::next(h), -1, m.at(query.s), 0);
    return true;
  });
  while (!scratch.heap.empty()) {
    std::pop_heap(scratch.heap.begin(), scratch.heap.end(), later);
    const std::int32_t number = scratch.heap.back().edge;
    scratch.heap.pop_back();
    CorridorSearch::Edge& edge = scratch.edges[static_cast<std::size_t>(number)];
    if (edge.settled) continue;
    edge.settled = true;
    const std::int32_t g = m.opposite(edge.half_edge);
    if (m.apex(g) == query.t && query.in_sector(query.t, query.at_t, WalledSurface::prev(g))) {
      for (std::int32_t i = number; i >= 0; i = scratch.edges[static_cast<std::size_t>(i)].parent)
        strip.push_back(scratch.edges[static_cast<std::size_t>(i)].half_edge);
      std::reverse(strip.begin(), strip.end());
      return true;
    }
    const Vec3 here = edge.middle;
    const double length = edge.length;
    offer(WalledSurface::next(g), number, here, length);
    offer(WalledSurface::prev(g), number, here, length);
  }
  return false;
}

}  // namespace kerf
