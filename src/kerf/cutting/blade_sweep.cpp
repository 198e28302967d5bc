#include "kerf/cutting/blade_sweep.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "kerf/base/at.h"
#include "kerf/cutting/blade_arcs.h"
#include "kerf/cutting/blade_front.h"
#include "kerf/cutting/path_opening.h"
#include "kerf/cutting/path_rounding.h"
#include "kerf/cutting/tolerances.h"
#include "kerf/spatial/segment_queries.h"
#include "kerf/spatial/triangle_queries.h"

namespace kerf {
namespace {

using V = CollisionVertex;
using H = CollisionHalfEdge;
using F = CollisionTriangle;
using Kind = ArcEnd::Kind;
using Stop = CutStop;

/// One move: finds the arcs, orders them, and cuts one after the other.
class Sweep {
 public:
  /// `others`: where vertices are at other times; the first at the last pose.
  Sweep(BladeStroke& stroke, SweepTarget& target, std::span<std::vector<Vec3>* const> others = {})
      : stroke_(stroke), target_(target), cut_{target.complex, target.options, target.scratch},
        rounding_(target.complex.collision, target.options, target.complex.mean_root_edge),
        finder_(target.complex, rounding_),
        opening_({cut_, target.position, target.boxes, others}, rounding_.feature(), rounding_.outside()),
        before_(others.empty() ? target.position : *others.front()),
        vertices_before_(target.complex.collision.vertex_count()) {}

  /// Cuts all arcs up to the last edges that they cross.
  SweepReport lead(const BladeEdge& to) {
    target_.scratch.flip_stack.clear();
    leads_ = true;
    old_ = std::move(stroke_.ends);
    stroke_.ends.clear();
    const double reach = cut::kMoveReach * target_.complex.mean_root_edge;
    move_ = BladeMove::through(material(), stroke_.posed, to, reach);
    std::vector<BladeArc> arcs = find(fronts());
    for (int i = 0; i < cut::kPathBends && bend(arcs); ++i) arcs = find(fronts());
    used_.assign(old_.size(), false);
    choose(arcs);
    for (int i = 0; i < cut::kPathTries && !left_.empty(); ++i) again();
    busy_ = static_cast<int>(left_.size());
    if (busy_ > 0) uncut_ = {UncutReason::kBusy, rounding_.rest(left_[0])};
    for (std::size_t i = 0; i < old_.size(); ++i)
      if (!used_[i] && finder_.locate(old_[i])) {
        if (waits(old_[i])) stroke_.ends.push_back(old_[i]);
        else (void)make_end(old_[i]);
      }
    leads_ = false;
    stroke_.standing = false;
    stroke_.posed = move_.is;

    std::vector<F> keep;
    for (BladeFront& f : stroke_.ends) {
      if (!finder_.locate(f)) continue;
      // Another path of the move may have run into where it begins.
      if (f.start.kind == Stop::Kind::kVertex)
        f.start.vertex = finder_.twin_towards(f.start.vertex, vertices_before_, f.end);
      keep.push_back(f.end.face);
    }
    opening_.turn_edges(keep);
    return report();
  }

  SweepReport make_ends() {
    stroke_.fronts.clear();
    for (BladeFront& f : stroke_.ends) {
      const PathEnd end = make_end(f);
      stroke_.fronts.push_back(end.vertex);
      if (!end.on_border) continue;
      const Vec3 x = rounding_.rest(f.end), border = mesh().rest[end.vertex];
      if (!f.touch || norm(border - x) < norm(f.touch->border - rounding_.rest(f.touch->at)))
        f.touch = BladeTouch{f.end, border};
    }
    if (dirty_) opening_.turn_edges({});
    stroke_.provisional = dirty_;
    return report();
  }

  SweepReport part_strands() {
    target_.scratch.flip_stack.clear();
    old_ = std::move(stroke_.ends);
    stroke_.ends.clear();
    for (std::size_t i = 0; i < old_.size(); ++i) keep_end(old_[i], stroke_.fronts[i]);
    for (const PassedRim& passed : stroke_.passed)
      if (passed.exists()) part_strand(passed);
    for (std::size_t i = 0; i < old_.size(); ++i)
      if (!stroke_.passed[i].exists() && finder_.locate(old_[i])) stroke_.ends.push_back(old_[i]);
    stroke_.passed.clear();
    stroke_.provisional = false;
    return report();
  }

 private:
  const CollisionMesh& mesh() const { return target_.complex.collision; }
  Vec3 at(V v) const { return target_.position[v.index()]; }
  MovedMaterial material() const { return {before_, target_.position}; }
  Vec3 place(const RestPoint& p) const { return place_of(mesh(), p, target_.position); }

  SweepReport report() const {
    return {opening_.opened(),  busy_ + opening_.refused(),
            opening_.retried(), uncut_.reason != UncutReason::kNone ? uncut_ : opening_.uncut(),
            leaning_,           dirty_};
  }

  /// The path of a front goes on from a vertex that it has come to.
  void keep_end(BladeFront& f, V vertex) const {
    if (f.start.kind == Stop::Kind::kVertex && f.start.vertex == vertex) return;
    f.before = f.start.kind == Stop::Kind::kVertex ? f.start.vertex : V{};
    f.start = Stop::at_vertex(vertex);
    f.came = rounding_.rest(f.end);
    f.trail.clear();
    f.touch.reset();
    (void)finder_.locate(f);
  }

  // ---- which arcs, in which order

  MovingFront front(const BladeFront& f) const { return {rounding_.rest(f.end), place(f.end)}; }
  std::vector<MovingFront> fronts() const {
    std::vector<MovingFront> fronts;
    for (const BladeFront& f : old_) fronts.push_back(front(f));
    return fronts;
  }
  std::vector<BladeArc> find(std::span<const MovingFront> fronts) const {
    target_.boxes.refresh(mesh(), target_.position);
    return find_arcs(mesh(), target_.boxes, material(), move_, fronts, rounding_.feature());
  }

  static bool is_front(const ArcEnd& e) { return e.kind == Kind::kFront; }
  /// Where a front's path turns, what it has cut stays, and it goes on from there; it turns off from a border only after it has been joined to it. True: one
  /// turns.
  bool bend(const std::vector<BladeArc>& arcs) {
    bool bent = false;
    for (const BladeArc& arc : arcs) {
      if (!is_front(arc.begin)) continue;
      BladeFront& f = old_[kerf::at(arc.begin.front)];
      const Vec3 from = rounding_.rest(f.start), is = rounding_.rest(f.end);
      Vec3 to = finder_.next_of(arc);
      // Back over what its path has crossed to come to where it is: what is crossed next lies on the way back.
      if (dot(to - is, is - from) < 0) {
        BladeArc led = arc;
        if (finder_.begin_at(led, f)) {
          PathRounding::reduce(led);
          to = finder_.next_of(led);
        }
      }
      const double tolerance = target_.options.path_tolerance * target_.complex.mean_root_edge;
      // In its slit a front forgets its trail.
      const Vec3 chord = rounding_.is_near(f.start, to) ? from : to;
      const auto off = [&](Vec3 p) { return distance_to_segment(p, from, chord); };
      const auto farthest =
          std::max_element(f.trail.begin(), f.trail.end(), [&](Vec3 p, Vec3 q) { return off(p) < off(q); });
      const bool turned = farthest != f.trail.end() && off(*farthest) > tolerance;
      const Vec3 last = rounding_.rest(stop_of(arc.end));
      const bool returns =
          arc.end.kind == Kind::kBorder && rounding_.same_lip(f.start, arc.end.border, rounding_.rest(f.start), last);
      const auto is_far = [&](double distance) { return distance >= rounding_.near(); };
      const bool goes_on =
          !arc.crossings.empty() && f.touch && is_far(norm(f.touch->border - rounding_.rest(arc.crossings.back())));
      const bool leaves = f.touch && (returns || goes_on || is_far(distance_to_segment(f.touch->border, f.came, last)));
      if (!leaves && !turned) continue;
      BladeFront until = f;
      std::vector<Vec3> trail;
      bool came_back = !leaves && dot(*farthest - is, is - from) > 0;
      if (leaves) {
        until.end = f.touch->at, (void)finder_.locate(until);
      } else if (came_back) {
        until.end.at = planar_of(mesh(), f.end.face, *farthest);
        came_back = finder_.locate(until);
        if (came_back) {
          trail.assign(farthest + 1, f.trail.end());
          until.trail.assign(f.trail.begin(), farthest);
        } else {
          until.end = f.end;
        }
      }
      const std::size_t vertices = mesh().vertex_count();
      const Vec3 came = rounding_.rest(until.end);
      const PathEnd end = make_end(until, !leaves || f.touch->needed);
      const Stop start = !end.made
                             ? f.start
                             : Stop::at_vertex(leaves ? finder_.twin_towards(end.vertex, vertices, f.end) : end.vertex);
      f = {start, end.before, f.end, came, false, std::move(trail), {}, f.beside, f.along};
      if (end.on_border || came_back) finder_.note(f);
      else if (norm(is - came) > 0) f.trail.push_back(is);  // a place that comes twice bends the drawn curve
      bent = true;
    }
    for (BladeFront& f : old_)
      if (bent) (void)finder_.locate(f);
    return bent;
  }

  /// Arcs whose faces other arcs have divided are looked for again.
  void again() {
    std::vector<RestPoint> points = std::move(left_);
    left_.clear();
    opening_.forget_divided();
    std::vector<MovingFront> fronts;
    std::vector<int> which;
    for (std::size_t i = 0; i < old_.size(); ++i)
      if (!used_[i] && finder_.locate(old_[i])) {
        fronts.push_back(front(old_[i]));
        which.push_back(static_cast<int>(i));
      }
    std::vector<BladeArc> arcs = find(fronts);
    for (RestPoint& p : points) {
      if (!finder_.locate(p, {})) continue;
      for (BladeArc& arc : arcs) {
        if (std::find(arc.faces.begin(), arc.faces.end(), p.face) == arc.faces.end()) continue;
        for (ArcEnd* e : {&arc.begin, &arc.end})
          if (is_front(*e)) e->front = which[kerf::at(e->front)];
        if (arc.begin.kind == Kind::kIs && arc.end.kind != Kind::kIs) arc.reverse();
        follow(arc);
        break;
      }
    }
  }

  void choose(std::vector<BladeArc>& arcs) {
    std::vector<BladeArc*> others;
    double time = 0, depth = -HUGE_VAL;
    bool any = false;
    for (BladeArc& arc : arcs) {
      if (is_front(arc.begin)) {
        follow(arc);
        any = true;
        if (arc.end.kind == Kind::kIs) continue;
        time = std::max(time, arc.end.time);
        depth = arc.end.depth;
      } else {
        if (is_done(arc)) continue;
        if (arc.begin.kind == Kind::kIs && arc.end.kind != Kind::kIs) arc.reverse();
        others.push_back(&arc);
      }
    }
    const auto last = [](const BladeArc& a) { return a.closed ? 1.0 : std::max(a.begin.time, a.end.time); };
    const auto least_depth = [](const BladeArc& a) { return std::min(a.begin.depth, a.end.depth); };
    if (stroke_.through) {
      std::stable_sort(others.begin(), others.end(),
                       [&](const BladeArc* a, const BladeArc* b) { return a->first < b->first; });
      for (BladeArc* arc : others) follow(*arc);
      return;
    }
    // One layer: on where the last arc has ended, or the one met first, nearest to the base.
    while (stroke_.ends.empty() && !others.empty()) {
      const auto rank = [&](const BladeArc* a) {
        const bool gone = any && last(*a) <= time + 1 / cut::kPathMoments;
        return std::array<double, 3>{gone ? 1.0 : 0.0, std::round(std::max(time, a->first) * cut::kPathMoments),
                                     any ? std::abs(least_depth(*a) - depth) : least_depth(*a)};
      };
      const auto best = std::min_element(others.begin(), others.end(),
                                         [&](const BladeArc* a, const BladeArc* b) { return rank(a) < rank(b); });
      BladeArc& arc = **best;
      if (rank(&arc)[0] > 0) break;
      others.erase(best);
      time = std::max(time, last(arc));
      depth = arc.end.depth;
      any = true;
      follow(arc);
    }
    // A sheet that the blade lies along is one layer.
    const std::size_t led = stroke_.ends.size();
    const bool along = !stroke_.cut_along.empty() ||
                       std::any_of(old_.begin(), old_.end(), [](const BladeFront& f) { return f.along; });
    for (BladeArc* arc : others)
      if (lies_along(*arc, along ? cut::kPathLeans : cut::kPathFlat) || is_beside_cut(*arc)) follow(*arc);
    // Beside those that lead on, none waits in a slit.
    if (led > 0)
      stroke_.ends.erase(std::remove_if(stroke_.ends.begin() + static_cast<std::ptrdiff_t>(led), stroke_.ends.end(),
                                        [](const BladeFront& f) { return f.in_slit; }),
                         stroke_.ends.end());
  }
  /// Of a sheet that lies along the blade a place is cut once in a stroke, wherever its lips swing.
  bool is_done(const BladeArc& arc) const {
    if (stroke_.cut_along.empty() || !lies_along(arc.faces.back(), cut::kPathLeans)) return false;
    const auto is_near = [&](Vec3 p) {
      return std::any_of(stroke_.cut_along.begin(), stroke_.cut_along.end(), [&](const auto& chord) {
        const Vec3 way = chord[1] - chord[0];
        const double foot = dot(p - chord[0], way) / dot(way, way);
        return foot >= 0 && foot <= 1 &&
               norm(p - lerp(chord[0], chord[1], foot)) < cut::kPathDone * target_.complex.mean_root_edge;
      });
    };
    return is_near(rounding_.rest(stop_of(arc.begin))) && is_near(rounding_.rest(stop_of(arc.end))) &&
           std::all_of(arc.crossings.begin(), arc.crossings.end(),
                       [&](const ArcCrossing& c) { return is_near(rounding_.rest(c)); });
  }
  /// Is an arc so near to what the stroke has cut along the blade that it is of the same sheet, however that lies?
  bool is_beside_cut(const BladeArc& arc) const {
    const double near = cut::kPathBeside * target_.complex.mean_root_edge;
    const auto is_near = [&](Vec3 p) {
      return std::any_of(stroke_.cut_along.begin(), stroke_.cut_along.end(),
                         [&](const auto& chord) { return distance_to_segment(p, chord[0], chord[1]) < near; });
    };
    return is_near(rounding_.rest(stop_of(arc.begin))) || is_near(rounding_.rest(stop_of(arc.end)));
  }
  bool lies_along(const BladeArc& a, double cosine) const {
    return lies_along(a.faces.front(), cosine) || lies_along(a.faces.back(), cosine);
  }
  bool begins_along(const BladeArc& a) const {
    return old_[kerf::at(a.begin.front)].along || lies_along(a.faces.front(), cut::kPathLeans);
  }
  bool lies_along(F face, double cosine) const {
    return kerf::lies_along(mesh(), target_.position, face, move_.is.along, cosine);
  }

  /// Along a sheet an edge comes to what lies ahead of a front when that is deep enough, not at once: until then the front waits at the tip of its slit.
  bool waits(const BladeFront& f) const {
    return f.along && f.start.kind == Stop::Kind::kVertex &&
           (!mesh().on_border(f.start.vertex) || rounding_.may_pass(f.start.vertex));
  }
  /// How far the lips of an arc will lie beside what the edge has swept.
  void note_leaning(const BladeArc& arc) {
    if (!target_.complex.closed || arc.crossings.empty() || arc.closed) return;
    const Vec3 swept = normalized(
        cross(move_.is.along, place(rest_point(mesh(), arc.end.point)) - place(rest_point(mesh(), arc.begin.point))));
    for (const F face : arc.faces) {
      if (lies_along(face, cut::kPathFlat)) continue;
      const H h = CollisionMesh::corner(face, 0);
      const std::array<V, 3> v = {mesh().from(h), mesh().to(h), mesh().apex(h)};
      const double half = (norm(mesh().offset[v[0]]) + norm(mesh().offset[v[1]]) + norm(mesh().offset[v[2]])) / 3;
      const double sine = std::abs(dot(normalized(cross(at(v[1]) - at(v[0]), at(v[2]) - at(v[0]))), swept));
      const double distance = half * sine / std::sqrt(1 - sine * sine);
      if (distance > leaning_.distance)
        leaning_ = {distance, (1.0 / 3) * (mesh().rest[v[0]] + mesh().rest[v[1]] + mesh().rest[v[2]])};
    }
  }

  // ---- one arc

  void follow(BladeArc& arc) {
    if (std::any_of(arc.faces.begin(), arc.faces.end(), [&](F f) { return opening_.divided(f); })) {
      left_.push_back(middle(arc));
      return;
    }
    along_ = lies_along(arc.faces.back(), cut::kPathLeans) ||
             (is_front(arc.begin) ? begins_along(arc) : lies_along(arc.faces.front(), cut::kPathLeans));
    note_leaning(arc);
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
    std::vector<Stop> stops = rounding_.stops_of(begin, arc, ends_at_blade ? Stop{} : end, beside);
    go_round_edge(stops, arc.faces.front(), trail);
    if (stops.size() > 1 || (begin.kind != Stop::Kind::kVertex && !begin.border(mesh()).valid())) {
      const std::size_t vertices = mesh().vertex_count();
      if (open(stops, drawn_)) {
        begin = Stop::at_vertex(ends_at_blade ? finder_.twin_towards(opening_.made().back(), vertices, goal)
                                              : opening_.made().back());
        before = before_last();
      } else if (opening_.only_crumbs() && stops.back().border(mesh()).valid()) {
        part_by_parts(stops);
        begin = stops.back();  // between two borders nothing but crumbs is left
        before = {};
      } else {
        return;
      }
      if (stops.size() > 1) trail.clear();
      // What it came near to is still to be joined while the path has not left it.
      if (stops.size() > 1 && touch && norm(touch->border - rounding_.rest(begin)) >= rounding_.near()) touch.reset();
      if (!touch) came = last_end;
    }
    if (!ends_at_blade) return;
    BladeFront f{begin, before, goal, came, false, std::move(trail), touch, beside, along_};
    finder_.note(f);
    stroke_.ends.push_back(std::move(f));
  }

  /// To the place of the rim that is nearest at rest: what is stretched between them says nothing better.
  void part_strand(const PassedRim& passed) {
    const Vec3 from = mesh().rest[passed.from], a = mesh().rest[mesh().from(passed.rim)],
               b = mesh().rest[mesh().to(passed.rim)];
    const Stop rim = rounding_.on_border(passed.rim, closest_on_segment(from, a, b));
    (void)open(std::array{Stop::at_vertex(passed.from), rim}, std::array{from, rounding_.rest(rim)});
  }

  /// The parts of a path that holds a crumb, from one border to the next: those without a crumb part the body.
  void part_by_parts(std::span<const Stop> stops) {
    std::size_t first = 0;
    for (std::size_t k = 1; k < stops.size(); ++k) {
      if (!stops[k].border(mesh()).valid()) continue;
      const std::span<const Stop> part = stops.subspan(first, k - first + 1);
      if (part.size() < stops.size()) (void)open(part, {}, false, false);
      first = k;
    }
  }

  /// A path that comes back to the chained edge which it begins on goes by the place of its trail farthest from there: that chain can't be drawn elsewhere.
  void go_round_edge(std::vector<Stop>& stops, F face, const std::vector<Vec3>& trail) const {
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
  bool comes_back(const Stop& first, const Stop& next, F face) const {
    if (first.kind == Stop::Kind::kEdge)
      return next.kind == Stop::Kind::kEdge && next.a == first.a && next.b == first.b;
    return first.kind == Stop::Kind::kVertex && std::any_of(std::begin(kCorners), std::end(kCorners), [&](int k) {
             const H h = CollisionMesh::corner(face, k);
             const bool begins = mesh().from(h) == first.vertex || mesh().to(h) == first.vertex;
             return begins && mesh().has_chain(h) && rounding_.distance(h, rounding_.rest(next)) < rounding_.feature();
           });
  }
  static constexpr int kCorners[] = {0, 1, 2};

  void cut_loop(const BladeArc& arc) {
    std::vector<Stop> stops = rounding_.stops_of({}, arc, {});
    if (stops.size() < 3) return;
    stops.push_back(stops.front());
    (void)open(stops, {}, true);
  }

  /// The edge comes down on its length: two fronts.
  void cut_to_both_sides(const BladeArc& arc) {
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

  bool open(std::span<const Stop> stops, std::span<const Vec3> drawn, bool closed = false, bool needed = true) {
    if (!(needed ? opening_.open(stops, drawn, closed) : opening_.open_if_possible(stops, drawn))) return false;
    if (leads_ && along_ && !stroke_.through)
      for (std::size_t i = 1; i < opening_.made().size(); ++i)
        stroke_.cut_along.push_back({mesh().rest[opening_.made()[i - 1]], mesh().rest[opening_.made()[i]]});
    return dirty_ = true;
  }

  V before_last() const { return opening_.made().size() > 1 ? opening_.made()[opening_.made().size() - 2] : V{}; }

  /// The front that an arc begins at, the arc led to where its path begins; or null, if none leads there: the arc lies on the other lip of the slit that the
  /// front waits in, and begins where the edge was.
  const BladeFront* take(BladeArc& arc, ArcEnd& begin) {
    const BladeFront& front = old_[kerf::at(begin.front)];
    if (!finder_.begin_at(arc, front)) {
      begin.kind = Kind::kWas;
      return nullptr;
    }
    used_[kerf::at(begin.front)] = true;
    return &front;
  }
  Stop stop_of(const ArcEnd& e) const {
    return e.kind == Kind::kBorder ? rounding_.on_border(e.border, e.fraction)
                                   : Stop::inside(rest_point(mesh(), e.point));
  }

  struct PathEnd {
    V vertex, before;
    bool made = false;       // something was cut; else the front's start, or a vertex beside it
    bool on_border = false;  // not its own lip
  };
  /// Cuts up to where a front's blade is, or to a border near it. `needed`: what can't be cut is a refusal.
  PathEnd make_end(const BladeFront& f, bool needed = true) {
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
    std::vector<Stop> stops =
        rounding_.stops_of(f.start, arc, joined ? stop_of(arc.end) : Stop::inside(f.end), f.beside);
    go_round_edge(stops, arc.faces.front(), f.trail);
    return open(stops, drawn_, false, needed) ? PathEnd{opening_.made().back(), before_last(), true, joined} : stay;
  }

  /// Has the stroke come back to where it began? Then that is where it ends, whatever runs beside it.
  bool closes(const BladeFront& f) const {
    const Vec3 is = rounding_.rest(f.end);
    return std::any_of(stroke_.began.begin(), stroke_.began.end(),
                       [&](Vec3 p) { return norm(is - p) < rounding_.feature(); });
  }

  /// A point in the middle of an arc.
  RestPoint middle(const BladeArc& arc) const {
    const std::size_t k = arc.faces.size() / 2;
    const auto on = [&](H h, double fraction) {
      return lerp(mesh().planar[h], mesh().planar[CollisionMesh::next(h)], fraction);
    };
    const auto end = [&](const ArcEnd& e) { return rest_point(mesh(), e.point).at; };
    const Vec2 a = k == 0 ? end(arc.begin) : on(arc.crossings[k - 1].far, 1 - arc.crossings[k - 1].fraction);
    const Vec2 b = k < arc.crossings.size() ? on(arc.crossings[k].near, arc.crossings[k].fraction) : end(arc.end);
    return {arc.faces[k], 0.5 * (a + b)};
  }

  BladeStroke& stroke_;
  SweepTarget& target_;
  cut::CutContext cut_;
  PathRounding rounding_;
  FrontFinder finder_;
  PathOpening opening_;
  const std::vector<Vec3>& before_;  // where vertices were at the last pose
  std::size_t vertices_before_;      // the move
  int busy_ = 0;                     // arcs whose faces were never free
  UncutPath uncut_;                  // the first of them
  LeaningCut leaning_;
  BladeMove move_;
  bool dirty_ = false;
  bool leads_ = false;           // what is opened is not provisional
  bool along_ = false;           // the arc at work, or its front, has come through a sheet that lies along the blade
  std::vector<BladeFront> old_;  // at the last pose
  std::vector<Vec3> drawn_;      // of one arc
  std::vector<char> used_;       // of old_: an arc has begun or ended there
  std::vector<RestPoint> left_;  // one of each arc whose faces another has divided
};

BladeEdge part_of(const BladeEdge& from, const BladeEdge& to, int i, int parts) {
  const double t = static_cast<double>(i) / parts;
  return i == parts ? to : BladeEdge{lerp(from.base, to.base, t), lerp(from.tip, to.tip, t)};
}
/// Vertices that were not there at the last pose have kept still.
void add_new(SweepTarget& target) {
  if (std::vector<Vec3>* const before = target.before)
    before->insert(before->end(), target.position.begin() + static_cast<std::ptrdiff_t>(before->size()),
                   target.position.end());
}
double angle(Vec3 a, Vec3 b) { return std::acos(std::clamp(dot(normalized(a), normalized(b)), -1.0, 1.0)); }

}  // namespace

SweepReport& SweepReport::operator+=(const SweepReport& other) {
  steps += other.steps;
  refused += other.refused;
  retried += other.retried;
  if (uncut.reason == UncutReason::kNone) uncut = other.uncut;
  if (other.leaning.distance > leaning.distance) leaning = other.leaning;
  changed |= other.changed;
  return *this;
}

SweepReport lead_blade(BladeStroke& stroke, const BladeEdge& edge, SweepTarget& target) {
  KERF_ASSERT(check_edge(edge).ok() && !stroke.provisional &&
              target.position.size() == target.complex.collision.vertex_count());
  SweepReport total;
  if (!stroke.started) {
    stroke.started = stroke.standing = true;
    stroke.posed = frame_of(edge);
    return total;
  }
  add_new(target);
  std::vector<Vec3>*const before = target.before, *const now = &target.position;
  const BladeEdge from = stroke.posed.edge();
  const double reach = cut::kMoveReach * target.complex.mean_root_edge;
  const Mat3 rotation = before ? motion_near({*before, *now}, from, edge, reach).rotation : Mat3{};
  const double turn = angle(rotation * (from.tip - from.base), edge.tip - edge.base);
  const int parts = std::clamp(static_cast<int>(std::ceil(turn / cut::kPathTurn)), 1, 64);
  if (!before || parts == 1) {
    for (int i = 1; i <= parts; ++i)
      if (const BladeEdge to = part_of(from, edge, i, parts); norm(to.tip - to.base) > 0)
        total += before ? Sweep(stroke, target, std::array{before}).lead(to) : Sweep(stroke, target).lead(to);
    return total;
  }
  // Material goes along evenly.
  std::vector<Vec3> first = *before, last = *now;
  const std::array others{before, &first, &last};
  for (int i = 1; i <= parts; ++i) {
    const BladeEdge to = part_of(from, edge, i, parts);
    if (!(norm(to.tip - to.base) > 0)) continue;
    for (std::size_t v = 0; v < last.size(); ++v)
      (*now)[v] = i == parts ? last[v] : lerp(first[v], last[v], static_cast<double>(i) / parts);
    target.boxes.forget();
    total += Sweep(stroke, target, others).lead(to);
    *before = *now;
  }
  return total;
}

SweepReport make_ends(BladeStroke& stroke, SweepTarget& target) { return Sweep(stroke, target).make_ends(); }

SweepReport part_strands(BladeStroke& stroke, SweepTarget& target) { return Sweep(stroke, target).part_strands(); }

bool meets_material(SweepTarget& target, const BladeEdge& from, const BladeEdge& to) {
  add_new(target);
  const MovedMaterial material{target.before ? *target.before : target.position, target.position};
  const BladeMove move =
      BladeMove::through(material, frame_of(from), to, cut::kMoveReach * target.complex.mean_root_edge);
  target.boxes.refresh(target.complex.collision, target.position);
  return !find_arcs(target.complex.collision, target.boxes, material, move, {}, 0).empty();
}

void lift_blade(BladeStroke& stroke) {
  stroke.started = stroke.standing = false;
  stroke.fronts.clear();
  stroke.ends.clear();
  stroke.passed.clear();
  stroke.cut_along.clear();
  stroke.began.clear();
  stroke.provisional = false;
}

}  // namespace kerf
