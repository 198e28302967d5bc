#include "kerf/cutting/blade_paths.h"

#include <algorithm>
#include <array>
#include <optional>

#include "kerf/base/at.h"
#include "kerf/cutting/tolerances.h"
#include "kerf/spatial/triangle_queries.h"

namespace kerf {
namespace {

using V = CollisionVertex;
using H = CollisionHalfEdge;
using F = CollisionTriangle;
using Kind = ArcEnd::Kind;
using Stop = CutStop;

constexpr int kCorners[] = {0, 1, 2};

bool is_front(const ArcEnd& e) { return e.kind == Kind::kFront; }

}  // namespace

BladePaths::BladePaths(BladeStroke& stroke, SweepTarget& target, std::span<std::vector<Vec3>* const> others)
    : stroke_(stroke), target_(target), cut_{target.complex, target.options, target.scratch},
      rounding_(target.complex.collision, target.options, target.complex.mean_root_edge),
      finder_(target.complex, rounding_),
      opening_({cut_, target.position, target.boxes, others}, rounding_.feature(), rounding_.outside()) {}

void BladePaths::start() {
  leads_ = true;
  old_ = std::move(stroke_.ends);
  stroke_.ends.clear();
  used_.assign(old_.size(), false);
}

void BladePaths::cut(BladeArc& arc, bool along) {
  along_ = along;
  if (arc.closed) return cut_loop(arc);
  if (arc.begin.kind == Kind::kIs && !arc.crossings.empty()) return cut_to_both_sides(arc);
  const bool ends_at_blade = arc.end.kind == Kind::kIs;
  RestPoint goal = rest_point(mesh(), arc.end.point);
  Stop begin, end;
  std::vector<Vec3> trail;
  std::optional<BladeTouch> touch;
  V before;
  BesideBorder beside;
  Vec3 came = rounding_.rest(rest_point(mesh(), arc.begin.point)), last_end = came;
  beside.set_place(came);
  if (const BladeFront* front = is_front(arc.begin) ? take(arc, arc.begin) : nullptr) {
    begin = front->start;
    trail = front->trail;
    touch = front->touch;
    before = front->before;
    came = front->came;
    beside = front->beside;
    last_end = rounding_.rest(front->end);
  } else {
    rounding_.join_begin(arc);
    begin = stop_of(arc.begin);
    if (arc.begin.kind == Kind::kWas) stroke_.began.push_back(came);
  }
  arc.reverse();
  if (const BladeFront* front = is_front(arc.begin) ? take(arc, arc.begin) : nullptr) {
    arc.reverse();
    end = front->start;
  } else {
    arc.reverse();
    if (!ends_at_blade) rounding_.join_end(arc, &begin, BesideBorder::none());
    end = ends_at_blade ? Stop::inside(goal) : stop_of(arc.end);
  }

  PathRounding::reduce(arc);
  drawn_.assign(1, came);
  drawn_.insert(drawn_.end(), trail.begin(), trail.end());
  for (const ArcCrossing& c : arc.crossings) drawn_.push_back(rounding_.rest(c));
  drawn_.push_back(rounding_.rest(rest_point(mesh(), arc.end.point)));
  // Along a lip that it begins or ends on nothing is cut.
  const Vec3 first = rounding_.rest(begin), last = rounding_.rest(end);
  const PathRounding::Slid slid = rounding_.slide(arc, begin, last, end);
  if (slid.all && !ends_at_blade) return;
  if (!slid.all && end.border(mesh()).valid()) {
    arc.reverse();
    const bool back = rounding_.slide(arc, end, first, begin).all;
    arc.reverse();
    if (back) return;
  }
  if (slid.all) arc.crossings.clear();
  if (norm(rounding_.rest(begin) - first) > 0) {
    trail.clear(), touch.reset();
    beside.set_place(slid.left);
  }
  if (ends_at_blade) {
    // What the path crosses up to where it has come already is seen.
    for (std::size_t k = 0; k < arc.crossings.size() && beside.sides != 0; ++k)
      if (const Vec3 x = rounding_.rest(arc.crossings[k]); beside.is_ahead(x))
        beside.come_to(mesh(), arc.faces[k], x, rounding_.beside());
    beside.come_to(mesh(), goal.face, rounding_.rest(goal), rounding_.beside());
    rounding_.hold_at_border(arc, goal);
  }
  rounding_.begin_on_edge(arc, begin);
  begin_with_room(begin);
  std::vector<Stop> stops = rounding_.stops_of(begin, arc, ends_at_blade ? Stop{} : end, beside);
  go_round_edge(stops, arc.faces.front(), trail);
  if (stops.size() > 1 || (begin.kind != Stop::Kind::kVertex && !begin.border(mesh()).valid())) {
    const std::size_t vertices = mesh().vertex_count();
    bool goes_on = true;
    if (open(stops, drawn_)) {
      begin = Stop::at_vertex(ends_at_blade ? finder_.twin_towards(opening_.made().back(), vertices, goal)
                                            : opening_.made().back());
      before = before_last();
    } else if (!opening_.only_crumbs()) {
      return;
    } else if (stops.back().border(mesh()).valid()) {
      part_by_parts(stops);
      begin = stops.back();  // between two borders nothing but crumbs is left
      before = {};
    } else {
      goes_on = false;  // so far it would only cut off a crumb
    }
    if (goes_on) {
      if (stops.size() > 1) trail.clear();
      // What it came near to is still to be joined while the path has not left it.
      if (stops.size() > 1 && touch && norm(touch->border - rounding_.rest(begin)) >= rounding_.near()) touch.reset();
      if (!touch) came = last_end;
    }
  }
  if (!ends_at_blade) return;
  BladeFront f{begin, before, goal, came, false, std::move(trail), touch, beside, along_};
  finder_.note(f);
  stroke_.ends.push_back(std::move(f));
}

void BladePaths::begin_with_room(Stop& begin) const {
  if (begin.kind != Stop::Kind::kInside || rounding_.moved_aside(begin.point, {}) == 0) return;
  double left = rounding_.feature();
  for (std::size_t i = 0; i + 1 < drawn_.size() && left > 0; ++i) {
    const double length = norm(drawn_[i + 1] - drawn_[i]), step = cut::kTrailStep * target_.complex.mean_root_edge;
    for (double at = 0; at < std::min(length, left); at += step) {
      const RestPoint there{begin.point.face,
                            planar_of(mesh(), begin.point.face, lerp(drawn_[i], drawn_[i + 1], at / length))};
      RestPoint found = there;
      if (!find_face(mesh(), found, {}, 0) || found.face != there.face) return;
      if (rounding_.moved_aside(there, {}) == 0) {
        begin.point = there;
        return;
      }
    }
    left -= length;
  }
}

void BladePaths::part_by_parts(std::span<const Stop> stops) {
  std::size_t first = 0;
  for (std::size_t k = 1; k < stops.size(); ++k) {
    if (!stops[k].border(mesh()).valid()) continue;
    const std::span<const Stop> part = stops.subspan(first, k - first + 1);
    if (part.size() < stops.size()) (void)open(part, {}, false, false);
    first = k;
  }
}

void BladePaths::go_round_edge(std::vector<Stop>& stops, F face, const std::vector<Vec3>& trail) const {
  if (stops.size() < 2 || !comes_back(stops[0], stops[1], face)) return;
  const Vec3 first = rounding_.rest(stops[0]), next = rounding_.rest(stops[1]);
  Vec3 farthest;
  double most = rounding_.feature();
  for (const Vec3 p : trail)
    if (const double far = distance_to_segment(p, first, next); far > most) most = far, farthest = p;
  if (most == rounding_.feature()) return;
  RestPoint point{face, planar_of(mesh(), face, farthest)};
  if (find_face(mesh(), point, stops[0].vertex, 0) && finder_.begins_in(stops[0], point.face))
    stops.insert(stops.begin() + 1, Stop::inside(point));
}
bool BladePaths::comes_back(const Stop& first, const Stop& next, F face) const {
  if (first.kind == Stop::Kind::kEdge) return next.kind == Stop::Kind::kEdge && next.a == first.a && next.b == first.b;
  return first.kind == Stop::Kind::kVertex && std::any_of(std::begin(kCorners), std::end(kCorners), [&](int k) {
           const H h = CollisionMesh::corner(face, k);
           const bool begins = mesh().from(h) == first.vertex || mesh().to(h) == first.vertex;
           return begins && mesh().has_chain(h) && rounding_.distance(h, rounding_.rest(next)) < rounding_.feature();
         });
}
void BladePaths::cut_loop(const BladeArc& arc) {
  std::vector<Stop> stops = rounding_.stops_of({}, arc, {});
  if (stops.size() < 3) return;
  stops.push_back(stops.front());
  (void)open(stops, {}, true);
}

void BladePaths::cut_to_both_sides(const BladeArc& arc) {
  const RestPoint ends[2] = {rest_point(mesh(), arc.begin.point), rest_point(mesh(), arc.end.point)};
  const std::vector<Stop> stops = rounding_.stops_of({}, arc, {});
  if (stops.empty()) return;
  Stop starts[2] = {stops.front(), stops.back()};
  V before[2];
  if (open(stops, {})) {
    const std::vector<V>& made = opening_.made();
    starts[0] = Stop::at_vertex(made.front()), starts[1] = Stop::at_vertex(made.back());
    before[0] = made.size() > 1 ? made[1] : V{}, before[1] = before_last();
  } else if (!opening_.only_crumbs() || !starts[0].border(mesh()).valid() || !starts[1].border(mesh()).valid()) {
    return;  // else both fronts go on from lips
  }
  for (int k = 0; k < 2; ++k) {
    BladeFront f{starts[k], before[k], ends[k], rounding_.rest(ends[1 - k]), false, {}, {}, BesideBorder::none(),
                 along_};
    finder_.note(f);
    stroke_.ends.push_back(std::move(f));
  }
}

bool BladePaths::open(std::span<const Stop> stops, std::span<const Vec3> drawn, bool closed, bool needed) {
  if (!(needed ? opening_.open(stops, drawn, closed) : opening_.open_if_possible(stops, drawn))) return false;
  if (leads_ && along_ && !stroke_.through)
    for (std::size_t i = 1; i < opening_.made().size(); ++i)
      stroke_.cut_along.push_back({mesh().rest[opening_.made()[i - 1]], mesh().rest[opening_.made()[i]]});
  return dirty_ = true;
}

const BladeFront* BladePaths::take(BladeArc& arc, ArcEnd& begin) {
  const BladeFront& front = old_[kerf::at(begin.front)];
  if (!finder_.begin_at(arc, front)) {
    begin.kind = Kind::kWas;
    return nullptr;
  }
  used_[kerf::at(begin.front)] = true;
  return &front;
}
Stop BladePaths::stop_of(const ArcEnd& e) const {
  return e.kind == Kind::kBorder ? rounding_.on_border(e.border, e.fraction)
                                 : Stop::inside(rest_point(mesh(), e.point));
}

PathEnd BladePaths::make_end(const BladeFront& f, bool needed) {
  along_ = f.along;
  const PathEnd stay{f.start.kind == Stop::Kind::kVertex ? f.start.vertex : f.start.a, f.before};
  BladeArc arc;
  arc.faces.push_back(f.end.face);
  arc.end.kind = Kind::kIs;
  arc.end.point = {f.end.face, weights_of(mesh(), f.end)};
  if (!finder_.begin_at(arc, f)) return stay;
  rounding_.join_end(arc, &f.start, closes(f) ? BesideBorder::none() : f.beside, f.in_slit);
  const bool joined = arc.end.kind == Kind::kBorder;
  if (!joined && (f.in_slit || norm(rounding_.rest(f.start) - rounding_.rest(f.end)) < rounding_.feature()))
    return stay;
  PathRounding::reduce(arc);
  drawn_.assign(1, f.came);
  drawn_.insert(drawn_.end(), f.trail.begin(), f.trail.end());
  drawn_.push_back(rounding_.rest(f.end));
  std::vector<Stop> stops = rounding_.stops_of(f.start, arc, joined ? stop_of(arc.end) : Stop::inside(f.end), f.beside);
  go_round_edge(stops, arc.faces.front(), f.trail);
  return open(stops, drawn_, false, needed) ? PathEnd{opening_.made().back(), before_last(), true, joined} : stay;
}

bool BladePaths::closes(const BladeFront& f) const {
  const Vec3 is = rounding_.rest(f.end);
  return std::any_of(stroke_.began.begin(), stroke_.began.end(),
                     [&](Vec3 p) { return norm(is - p) < rounding_.feature(); });
}

V BladePaths::before_last() const {
  return opening_.made().size() > 1 ? opening_.made()[opening_.made().size() - 2] : V{};
}

}  // namespace kerf
