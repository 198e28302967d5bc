#include "kerf/cutting/blade_sweep.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "kerf/base/at.h"
#include "kerf/cutting/blade_paths.h"
#include "kerf/cutting/tolerances.h"
#include "kerf/spatial/triangle_queries.h"

namespace kerf {
namespace {

using H = CollisionHalfEdge;
using F = CollisionTriangle;
using Kind = ArcEnd::Kind;
using Stop = CutStop;

/// One move: finds the arcs, orders them, and has one after the other cut.
class Sweep {
 public:
  /// `others`: where vertices are at other times; the first at the last pose.
  Sweep(BladeStroke& stroke, SweepTarget& target, std::span<std::vector<Vec3>* const> others = {})
      : stroke_(stroke), target_(target), paths_(stroke, target, others),
        before_(others.empty() ? target.position : *others.front()),
        vertices_before_(target.complex.collision.vertex_count()) {}

  /// Cuts all arcs up to the last edges that they cross.
  SweepReport lead(const BladeEdge& to) {
    target_.scratch.flip_stack.clear();
    paths_.start();
    const double reach = cut::kMoveReach * target_.complex.mean_root_edge;
    move_ = BladeMove::through(material(), stroke_.posed, to, reach);
    std::vector<BladeArc> arcs = find(fronts());
    for (int i = 0; i < cut::kPathBends && bend(arcs); ++i) arcs = find(fronts());
    choose(arcs);
    for (int i = 0; i < cut::kPathTries && !left_.empty(); ++i) again();
    busy_ = static_cast<int>(left_.size());
    if (busy_ > 0) uncut_ = {UncutReason::kBusy, rounding_.rest(left_[0])};
    for (std::size_t i = 0; i < old_.size(); ++i)
      if (!paths_.is_used(i) && finder_.locate(old_[i])) (void)paths_.make_end(old_[i]);
    paths_.finish();
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
      const PathEnd end = paths_.make_end(f);
      stroke_.fronts.push_back(end.vertex);
      if (!end.on_border) continue;
      const Vec3 x = rounding_.rest(f.end), border = mesh().rest[end.vertex];
      if (!f.touch || norm(border - x) < norm(f.touch->border - rounding_.rest(f.touch->at)))
        f.touch = BladeTouch{f.end, border};
    }
    if (paths_.has_cut()) opening_.turn_edges({});
    stroke_.provisional = paths_.has_cut();
    return report();
  }

 private:
  const CollisionMesh& mesh() const { return target_.complex.collision; }
  MovedMaterial material() const { return {before_, target_.position}; }

  SweepReport report() const {
    return {opening_.opened(),  busy_ + opening_.refused(),
            opening_.retried(), uncut_.reason != UncutReason::kNone ? uncut_ : opening_.uncut(),
            leaning_,           paths_.has_cut()};
  }

  MovingFront front(const BladeFront& f) const {
    return {rounding_.rest(f.end), place_of(mesh(), f.end, target_.position)};
  }
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
      const Vec3 last = rounding_.rest(paths_.stop_of(arc.end));
      const bool returns =
          arc.end.kind == Kind::kBorder && rounding_.same_lip(f.start, arc.end.border, rounding_.rest(f.start), last);
      const auto is_far = [&](double distance) { return distance >= rounding_.near(); };
      const bool goes_on =
          !arc.crossings.empty() && f.touch && is_far(norm(f.touch->border - rounding_.rest(arc.crossings.back())));
      const bool leaves = f.touch && (returns || goes_on || is_far(distance_to_segment(f.touch->border, f.came, last)));
      if (!leaves && !turned) continue;
      BladeFront until = f;
      std::vector<Vec3> trail;
      // It bends where it is; where its way came back before it did; or else at the last place where the vertex stays where it is put.
      auto place = f.trail.cend();
      if (!leaves && dot(*farthest - is, is - from) > 0) {
        place = farthest;
      } else if (!leaves) {
        double aside = rounding_.moved_aside(f.end, f.start);
        place = finder_.least_moved(f, to, tolerance, aside);
        if (aside > cut::kBendAside * rounding_.feature() && off(*farthest) < rounding_.feature()) continue;
      }
      const bool earlier = place != f.trail.cend() && finder_.move_to(until, *place);
      if (leaves) until.end = f.touch->at, (void)finder_.locate(until);
      if (earlier) trail.assign(place + 1, f.trail.cend()), until.trail.assign(f.trail.cbegin(), place);
      const std::size_t vertices = mesh().vertex_count();
      const Vec3 came = rounding_.rest(until.end);
      const PathEnd end = paths_.make_end(until, !leaves || f.touch->needed);
      const Stop start = !end.made
                             ? f.start
                             : Stop::at_vertex(leaves ? finder_.twin_towards(end.vertex, vertices, f.end) : end.vertex);
      f = {start, end.before, f.end, came, false, std::move(trail), {}, f.beside, f.along};
      if (end.on_border || earlier) finder_.note(f);
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
      if (!paths_.is_used(i) && finder_.locate(old_[i])) {
        fronts.push_back(front(old_[i]));
        which.push_back(static_cast<int>(i));
      }
    std::vector<BladeArc> arcs = find(fronts);
    for (BladeArc& arc : arcs)
      for (ArcEnd* e : {&arc.begin, &arc.end})
        if (is_front(*e)) e->front = which[kerf::at(e->front)];
    for (RestPoint& p : points) {
      if (!finder_.locate(p, {})) continue;
      const auto there = std::find_if(arcs.begin(), arcs.end(), [&](const BladeArc& arc) {
        return std::find(arc.faces.begin(), arc.faces.end(), p.face) != arc.faces.end();
      });
      if (there == arcs.end()) continue;
      BladeArc arc = std::move(*there);
      arcs.erase(there);
      if (arc.begin.kind == Kind::kIs && arc.end.kind != Kind::kIs) arc.reverse();
      follow(arc);
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
    return is_near(rounding_.rest(paths_.stop_of(arc.begin))) && is_near(rounding_.rest(paths_.stop_of(arc.end))) &&
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
    return is_near(rounding_.rest(paths_.stop_of(arc.begin))) || is_near(rounding_.rest(paths_.stop_of(arc.end)));
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

  void follow(BladeArc& arc) {
    if (std::any_of(arc.faces.begin(), arc.faces.end(), [&](F f) { return opening_.divided(f); })) {
      left_.push_back(middle(arc));
      return;
    }
    const bool along = lies_along(arc.faces.back(), cut::kPathLeans) ||
                       (is_front(arc.begin) ? begins_along(arc) : lies_along(arc.faces.front(), cut::kPathLeans));
    if (target_.complex.closed) find_leaning(mesh(), target_.position, arc, move_.is.along, leaning_);
    paths_.cut(arc, along);
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
  BladePaths paths_;
  const PathRounding& rounding_ = paths_.rounding();
  const FrontFinder& finder_ = paths_.finder();
  PathOpening& opening_ = paths_.opening();
  std::vector<BladeFront>& old_ = paths_.fronts();  // at the last pose
  const std::vector<Vec3>& before_;                 // where vertices were then
  std::size_t vertices_before_;                     // the move
  int busy_ = 0;                                    // arcs whose faces were never free
  UncutPath uncut_;                                 // the first of them
  LeaningCut leaning_;
  BladeMove move_;
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
  stroke.cut_along.clear();
  stroke.began.clear();
  stroke.provisional = false;
}

}  // namespace kerf
