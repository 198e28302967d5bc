#include "kerf/cutting/blade_sweep.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "kerf/cutting/blade_entry.h"
#include "kerf/cutting/blade_track.h"
#include "kerf/spatial/triangle_queries.h"

namespace kerf {
namespace {

using V = CollisionVertex;
using H = CollisionHalfEdge;
using F = CollisionTriangle;

constexpr double kMaxTurn = 0.05;       // rad; a swept strip that turns less is flat for our purpose
constexpr double kAlongLip = 1e-3;      // of an edge's length: a direction so near to a lip runs along it
constexpr double kBack = 0.7;           // cosine: a blade that goes so straight back cuts nothing
constexpr double kAhead = 0.5;           // cosine at rest between the way of a slit and the border that it comes to
constexpr double kBeside = 2.5;         // minimum features: a front that has just begun, or snaps, may stand so far beside the blade's track
constexpr double kSideways = 0.1;       // cosine between the way that a front must take and one that will do
constexpr double kKnownWay = 0.25;      // minimum features; a move that is shorter does not say where the blade came from
constexpr double kSlack = 2;            // minimum features behind the blade's last pose that still count as swept
constexpr double kCameFrom = 0.5;       // mean edges: an edge that stands so near to a border in the material has come in from there
constexpr double kOffPlane = 1e-6;      // mean edges: a point so near to a face's plane lies in it
constexpr double kRounding = 1e-8;      // of coordinates, of mean edges
constexpr double kSameTrack = 0.5;      // of the minimum feature: nearer hits are the layer that a front already cuts

/// Where the cut has got to in one layer.
struct Front {
  V tip;
  Vec3 way;             // it must go there first, or zero
  FacePoint last_bit;   // an end inside a face, done after the commit; no face: none
  bool goes_on = false; // it has cut, or will
  bool waits = false;   // the blade is back in the slit
};

class Sweep {
 public:
  Sweep(BladeStroke& stroke, SweepTarget& target) : stroke_(stroke), target_(target) {
    feature_ = target.options.minimum_feature * target.complex.mean_root_edge;
  }

  SweepReport run(const BladeEdge& to) {
    to_ = to;
    for (const V tip : stroke_.fronts) ends_.push_back(at(tip));
    redo_provisional_end();
    // Entries are looked for before anything moves: afterwards the fronts' own tracks would be met again.
    std::vector<BladeEntry> entries;
    const bool all_back = std::all_of(stroke_.fronts.begin(), stroke_.fronts.end(), [&](V tip) { return goes_back(tip); });
    if (stroke_.through || all_back) entries = find_entries(all_back ? std::span<const V>() : stroke_.fronts, ends_);  // one that waits is not where the edge stands
    first_pose_ = stroke_.standing;
    stroke_.standing = false;

    const std::size_t old_fronts = stroke_.fronts.size();
    bool crossed = false;
    for (std::size_t i = 0; i < old_fronts; ++i) {
      if (met_along(at(stroke_.fronts[i]), true)) continue;
      const Followed way = follow(stroke_.fronts[i], stroke_.ways[i], first_layer_is_led());
      crossed |= way.moved;
      // The blade leaves the material from where it was: what was provisional there is cut for good.
      if (way.lost && !way.moved && redone_ && i < stroke_.last_bits.size() && stroke_.last_bits[i].face.valid() &&
          touches(stroke_.fronts[i], stroke_.last_bits[i].face))
        crossed |= advance(stroke_.fronts[i], stroke_.last_bits[i]).has_value();
    }
    for (const BladeEntry& e : entries) {
      if (!enter(e, old_fronts)) continue;
      crossed = true;
      if (!stroke_.through) break;
    }
    // A front that went along the lip of a slit is lost where the slit ends: there it goes on.
    if (!stroke_.through && fronts_.empty()) {
      for (const BladeEntry& e : find_entries({}, {}))
        if (e.slit_end && enter(e, old_fronts)) {
          crossed = true;
          break;
        }
    }
    if (std::none_of(fronts_.begin(), fronts_.end(), [](const Front& f) { return f.goes_on; })) crossed |= lead_in_where_it_stands();
    if (crossed) report_.changed = true;
    if (!stroke_.through) drop_waiting();
    std::vector<FacePoint> last_bits;
    stroke_.fronts.clear();
    stroke_.ways.clear();
    for (const Front& f : fronts_) {
      stroke_.fronts.push_back(f.tip);
      stroke_.ways.push_back(f.way);
      last_bits.push_back(f.last_bit);
    }

    // The provisional ends.
    const bool ends_inside = std::any_of(last_bits.begin(), last_bits.end(), [](const FacePoint& p) { return p.face.valid(); });
    if (ends_inside) {
      // Walked again from the same mark: the mark and the trail stay, so that a slow bend adds up.
      if (crossed || !redone_ || stroke_.fronts.size() != stroke_.committed.size()) commit();
      for (std::size_t i = 0; i < stroke_.fronts.size(); ++i)
        if (last_bits[i].face.valid()) {
          if (!touches(stroke_.fronts[i], last_bits[i].face)) continue;  // another front has split it; next time
          const auto step = advance(stroke_.fronts[i], last_bits[i]);
          if (step) {
            if (step->tip != stroke_.fronts[i]) stroke_.ways[i] = {};
            stroke_.fronts[i] = step->tip;
            if (step->kind != Advance::Kind::kNothing) report_.changed = stroke_.provisional = true;
          }
        }
      stroke_.last_bits = last_bits;
      if (stroke_.provisional)
        for (const V v : stroke_.fronts) stroke_.trail.push_back(target_.complex.collision.rest[v]);
    } else if (crossed) {
      commit();
    }
    stroke_.edge = to;
    return report_;
  }

 private:
  const CollisionMesh& mesh() const { return target_.complex.collision; }
  Vec3 at(V v) const { return target_.position[v.index()]; }

  std::vector<BladeEntry> find_entries(std::span<const V> fronts, std::span<const Vec3> ends) {
    target_.boxes.refresh(mesh(), target_.position);
    return find_blade_entries({target_.complex, target_.position, target_.boxes, stroke_.edge, to_, stroke_.through, stroke_.standing, fronts, ends});
  }
  /// Starts a cut there, and one or two fronts. False: it is cut already, or refused.
  bool enter(const BladeEntry& e, std::size_t old_fronts) {
    if (on_a_track(e.position, old_fronts)) return false;
    if (stands_inside(e) && !first_pose_)
      if (const auto border = nearest_border(e.position, kCameFrom * target_.complex.mean_root_edge + 2 * norm(edge_motion(e.position)), true))
        return lead_in(*border, e.position);
    const auto located = relocate(e);
    if (!located) return false;
    const auto start = start_here(*located);
    if (!start) return false;
    for (int k = 0; k == 0 || (k < 2 && norm(e.ways[1]) > 0); ++k) (void)follow(*start, e.ways[static_cast<std::size_t>(k)], k > 0 && !stroke_.through);
    return true;
  }

  /// The edge goes through the material there, upright.
  static bool stands_inside(const BladeEntry& e) { return e.standing && !(norm(e.ways[1]) > 0); }

  /// Cuts from a border to where the edge stood in the material at the last pose, and on from there.
  bool lead_in(const FacePoint& border, Vec3 standing) {
    const auto start = start_here(border);
    if (!start) return false;
    const Vec3 way = standing - at(*start);
    const std::size_t before = fronts_.size();
    const BladeEdge goal = std::exchange(to_, stroke_.edge);
    const Followed led = follow(*start, norm(way) > 0 ? normalized(way) : Vec3{}, false);
    to_ = goal;
    if (fronts_.size() == before) return led.moved;  // it went out of the material on the way
    V tip = fronts_.back().tip;
    const FacePoint last_bit = fronts_.back().last_bit;
    fronts_.pop_back();
    if (last_bit.face.valid())
      if (const auto step = advance(tip, last_bit)) tip = step->tip;
    (void)follow(tip, {}, false);
    return true;
  }

  /// The edge has come to stand in the material, and no front has gone with it: it has left the border that it was at before.
  bool lead_in_where_it_stands() {
    target_.boxes.refresh(mesh(), target_.position);
    std::vector<Vec3> ends;
    for (const Front& f : fronts_) ends.push_back(at(f.tip));
    bool led = false;
    for (const BladeEntry& e : find_blade_entries({target_.complex, target_.position, target_.boxes, to_, to_, stroke_.through, false, {}, ends})) {
      if (!stands_inside(e)) continue;
      const auto border = nearest_border(lerp(stroke_.edge.base, stroke_.edge.tip, e.depth), kCameFrom * target_.complex.mean_root_edge, false);
      if (!border) continue;
      const auto start = start_here(*border);
      if (!start) continue;
      led |= follow(*start, {}, false).moved || (!fronts_.empty() && fronts_.back().goes_on);
      if (led && !stroke_.through) break;
    }
    return led;
  }

  /// The point of a border nearest to x, less than `reach` away. `inside`: of those borders only that x is on the material's side of.
  std::optional<FacePoint> nearest_border(Vec3 x, double reach, bool inside) {
    const Box3 region{x - Vec3{reach, reach, reach}, x + Vec3{reach, reach, reach}};
    target_.boxes.refresh(mesh(), target_.position);
    std::optional<FacePoint> found;
    double least = reach;
    target_.boxes.for_each([&](const Box3& box) { return boxes_meet(box, region); }, [&](F face) {
      for (int k = 0; k < 3; ++k) {
        const H h = CollisionMesh::corner(face, k);
        if (!mesh().is_border(h)) continue;
        const Vec3 a = at(mesh().from(h)), b = at(mesh().to(h)), c = at(mesh().apex(h));
        const double f = std::clamp(dot(x - a, b - a) / std::max(dot(b - a, b - a), 1e-300), 0.0, 1.0);
        const double distance = norm(x - lerp(a, b, f));
        if (distance >= least || (inside && dot(cross(cross(b - a, c - a), b - a), x - a) < 0)) continue;
        least = distance;
        found = FacePoint{face, {}};
        found->weights[static_cast<std::size_t>(k)] = 1 - f;
        found->weights[static_cast<std::size_t>((k + 1) % 3)] = f;
      }
    });
    return found;
  }

  /// Fronts that only wait for the blade to come back, while it cuts elsewhere.
  void drop_waiting() {
    if (std::none_of(fronts_.begin(), fronts_.end(), [](const Front& f) { return f.goes_on; })) return;
    std::erase_if(fronts_, [](const Front& f) { return f.waits; });
  }

  /// A front of the only layer that is to be cut goes on: what others cut is that layer too as long as it lies along the blade.
  bool first_layer_is_led() const {
    return !stroke_.through && std::any_of(fronts_.begin(), fronts_.end(), [](const Front& f) { return !f.waits; });
  }

  void commit() {
    stroke_.mark = target_.commit();
    stroke_.committed = stroke_.fronts;
    stroke_.committed_ways = stroke_.ways;
    stroke_.trail.clear();
    stroke_.provisional = false;
  }

  /// Rolls the provisional ends back, unless the blade has left the straight line to where it is going.
  void redo_provisional_end() {
    if (!stroke_.provisional) return;
    const std::size_t n = stroke_.fronts.size();
    const double tolerance = target_.options.path_tolerance * target_.complex.mean_root_edge;
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3 start = mesh().rest[stroke_.committed[i]];
      const Vec3 last = stroke_.trail[stroke_.trail.size() - n + i];
      // The next end is not known yet; it continues the present one unless the blade turns there.
      const Vec3 front_now = at(stroke_.fronts[i]), start_now = at(stroke_.committed[i]);
      const auto plane = TrackPlane::make(start_now, to_);
      double off = plane ? std::abs(plane->orient3d_value(front_now)) /
                               std::max(norm(cross(plane->b - plane->a, plane->c - plane->a)), 1e-300)
                         : norm(front_now - start_now);
      for (std::size_t k = i; k < stroke_.trail.size(); k += n) {
        const Vec3 chord = last - start, p = stroke_.trail[k] - start;
        const double length2 = dot(chord, chord);
        const double s = length2 > 0 ? std::clamp(dot(p, chord) / length2, 0.0, 1.0) : 0.0;
        off = std::max(off, norm(p - s * chord));
      }
      // A blade that moves back keeps what it has cut.
      if (plane && plane->progress(front_now) > feature_) off = HUGE_VAL;
      if (off > tolerance) {
        commit();
        return;
      }
    }
    target_.rollback(stroke_.mark);
    target_.position.resize(mesh().vertex_count());
    stroke_.fronts = stroke_.committed;
    stroke_.ways = stroke_.committed_ways;
    stroke_.provisional = false;
    redone_ = true;
    report_.changed = true;
  }

  struct Followed {
    bool moved = false;  // past the vertex it stood at
    bool lost = false;   // the blade is no longer in the material
  };
  /// Walks one front towards the blade's new edge over as many triangles as it takes; `way`: where to first (or zero). Notes the front,
  /// if it is still in the material, and its last bit inside a face (or none).
  /// `flat_only`: no farther than it lies along the blade.
  Followed follow(V tip, Vec3 way_on, bool flat_only) {
    const auto stay = [&](const FacePoint& last_bit, bool moved, bool waits = false) {
      fronts_.push_back({tip, moved ? Vec3{} : way_on, last_bit, moved || last_bit.face.valid(), waits});
      visited_.push_back({at(tip), last_bit.face.valid() ? place(last_bit) : at(tip)});
      return Followed{moved, false};
    };
    const bool joined = std::find(joined_.begin(), joined_.end(), tip) != joined_.end();
    bool moved = false;
    std::vector<V> been{mesh().ancestor[tip]};
    const std::size_t limit = 100 + 4 * mesh().face_count();
    for (std::size_t round = 0; round < limit; ++round) {
      auto plane = TrackPlane::make(at(tip), to_);
      const SlitCorner slit = norm(way_on) > 0 ? SlitCorner{} : slit_at(mesh(), target_.position, tip);
      // A front that has just begun may stand at a corner beside the blade's track.
      bool fresh = !moved && norm(way_on) > 0;
      if (plane && (fresh ? is_flat(at(tip), way_on) : !moved && !slit.cut && norm(flat_normal(tip)) > 0))
        if (const auto side = side_plane(tip, *plane)) plane = side, fresh = false;
      // The blade is here.
      if (!plane || plane->progress(at(tip)) > (fresh ? -kBeside : -0.5) * feature_) return stay(plane ? joined_end(tip, {}) : FacePoint{}, moved);
      if (!moved && goes_back(tip)) return stay({}, false, true);
      const Vec3 onwards = slit.ends() ? -1.0 * slit.lips : way_on;
      const bool out = slit.ran_out();
      auto way = leave_vertex(tip, *plane, moved ? Vec3{} : way_on, onwards, out);
      if (!way && joined && !moved) return {false, true};  // another front has come to meet this one
      // A stab at the end of a blade may lead out beyond that end, or in.
      if (!out && (!way || (way->missed && !(norm(onwards) > 0)))) {
        const auto side = side_plane(tip, *plane);
        auto beside = side ? leave_beside(tip, *side, onwards) : std::nullopt;
        if (!beside) beside = leave_beside(tip, *plane, onwards);
        if (beside && !(way && beside->missed)) way = beside;
      }
      if (!way) way = leave_turned_over(tip, *plane);
      if (!way) {  // no material ahead: out over the rim, or into an open slit
        const auto again = enter_next_lip(tip, *plane);
        if (!again) return {moved, true};
        tip = *again;
        moved = true;
        continue;
      }
      if (way->missed) return {moved, true};  // the blade's edge no longer reaches the surface
      if (flat_only && !is_flat(at(tip), place(way->target) - at(tip))) return {moved, true};
      if (way->inside) return stay(joined_end(tip, way->target), moved);
      const Vec3 before = at(tip);
      const auto step = advance(tip, way->target);
      if (!step) return {moved, true};
      if (step->kind == Advance::Kind::kNothing || step->tip == tip) return stay({}, moved);
      moved = true;
      tip = step->tip;
      way_on = normalized(at(tip) - before);
      visited_.push_back({before, at(tip)});
      if (step->kind == Advance::Kind::kRanOut) joined_.push_back(tip);
      if (way->last) return {true, true};
      // No circles: every one would cut what the last one left.
      if (std::find(been.begin(), been.end(), mesh().ancestor[tip]) != been.end()) return {true, true};
      been.push_back(mesh().ancestor[tip]);
    }
    return {moved, true};
  }

  /// The tip is the end of a slit, and the blade is somewhere back between its lips. One that was at that end and goes back beside the lips, farther from
  /// them than the minimum feature, cuts: however sharp it turns there.
  bool goes_back(V tip) const {
    const auto plane = TrackPlane::make(at(tip), to_);
    if (!plane) return false;
    const SlitCorner slit = slit_at(mesh(), target_.position, tip);
    if (!slit.turns_back() || !(dot(slit.lips, plane->motion) > kBack * norm(slit.lips))) return false;
    const Vec3 along = normalized(stroke_.edge.tip - stroke_.edge.base), off = at(tip) - stroke_.edge.base;
    if (norm(off - dot(off, along) * along) > feature_) return true;
    const auto way = leave_vertex(tip, *plane, {}, {}, false);
    return !way || distance_to_lips(tip, place(way->target)) < feature_;
  }
  /// Of a point to the borders that begin and end at a vertex, as if they went straight on.
  double distance_to_lips(V tip, Vec3 p) const {
    double least = HUGE_VAL;
    const auto look_at = [&](V other) {
      const Vec3 lip = normalized(at(other) - at(tip)), x = p - at(tip);
      least = std::min(least, norm(x - std::max(dot(x, lip), 0.0) * lip));
    };
    mesh().for_each_outgoing(tip, [&](H h) {
      if (mesh().is_border(h)) look_at(mesh().to(h));
      if (const H in = CollisionMesh::prev(h); mesh().is_border(in)) look_at(mesh().from(in));
      return true;
    });
    return least;
  }

  struct Way {
    FacePoint target;
    bool inside = false;  // the blade's edge is reached inside the face
    bool missed = false;  // the blade's edge does not extend to the surface there
    bool last = false;    // it does up to the target
  };

  /// Which part of the blade passed a point of the track, and when.
  Passing passing(const TrackPlane& plane, Vec3 p) const {
    const double behind = plane.progress(p), beside = plane.along_blade(p);
    const Vec3 base = to_.base - stroke_.edge.base, tip = to_.tip - stroke_.edge.tip;
    Passing found{beside, -HUGE_VAL};
    for (int i = 0; i < 3; ++i) {
      const Vec3 move = lerp(base, tip, std::clamp(found.depth, 0.0, 1.0));
      const double pace = dot(move, plane.motion);
      if (!(pace > 0)) return {beside, -HUGE_VAL};
      found.time = 1 + behind / pace;
      // What lies further back was passed before: the blade was not elsewhere than at the beginning of this move.
      found.depth = beside + (1 - std::clamp(found.time, 0.0, 1.0)) * dot(move, plane.along) / plane.along_squared;
      // Within the slack it counts as passed in this move.
      if (found.time < 0 && -found.time * pace <= kSlack * feature_) found.time = 0;
    }
    return found;
  }

  /// The face of the tip's fan that the track runs through ahead, and where it leaves it.
  /// It leads first where `way_on` says (or zero), and where it lies along the blade not back from `onwards`, nor anywhere from where a cut ran `out`.
  std::optional<Way> leave_vertex(V tip, const TrackPlane& plane, Vec3 way_on, Vec3 onwards, bool out) const {
    std::optional<Way> best;
    double best_progress = kLeastProgress;
    for_each_way(tip, plane, [&](H h, double f, Vec3 p, Vec3 direction) {
      const double progress = dot(direction, plane.motion);
      if (progress < kFlat && out) return;
      if (progress < kFlat && dot(direction, onwards) < 0) return;
      if (progress <= best_progress || (norm(way_on) > 0 && dot(direction, way_on) < kSideways)) return;
      best_progress = progress;
      best = way_to(tip, plane, h, f, p);
    });
    return best;
  }

  /// What the edge itself moves by where it passes a point.
  Vec3 edge_motion(Vec3 p) const {
    const Vec3 along = to_.tip - to_.base;
    const double squared = dot(along, along), depth = std::clamp(dot(p - to_.base, along) / squared, 0.0, 1.0);
    const Vec3 motion = lerp(to_.base - stroke_.edge.base, to_.tip - stroke_.edge.tip, depth);
    return motion - (dot(motion, along) / squared) * along;
  }
  /// A way along the blade.
  bool is_flat(Vec3 where, Vec3 way) const {
    const Vec3 motion = edge_motion(where);
    return std::abs(dot(way, motion)) < kFlat * norm(way) * norm(motion);
  }
  /// Normal of the surface at a vertex, if the blade is parallel to all faces around; or zero.
  Vec3 flat_normal(V tip) const {
    const Vec3 along = normalized(to_.tip - to_.base);
    Vec3 sum;
    bool lies = true;
    mesh().for_each_outgoing(tip, [&](H h) {
      const Vec3 normal = cross(at(mesh().to(h)) - at(tip), at(mesh().apex(h)) - at(tip));
      sum += normal;
      lies = std::abs(dot(normal, along)) < kFlat * norm(normal);
      return lies;
    });
    return lies ? sum : Vec3{};
  }
  /// The plane of a track along the blade. The one through the tip and the edge is worth nothing for that where the tip is near the edge, and would
  /// never lead back to where the blade has passed. None where the blade does not lie along the surface.
  std::optional<TrackPlane> side_plane(V tip, const TrackPlane& plane) const {
    // The plane that the blade has swept in this move, if the tip lies beside it only because cuts snap.
    const Vec3 motion = edge_motion(at(tip));
    if (norm(motion) > kKnownWay * feature_ && norm(motion) + kSlack * feature_ > -plane.progress(at(tip))) {
      auto strip = TrackPlane::make(to_.base + plane.along_blade(at(tip)) * plane.along - motion, to_);
      if (strip && std::abs(dot(at(tip) - to_.base, normalized(cross(strip->along, strip->motion)))) < kBeside * feature_) return strip;
    }
    // Else upright on the surface.
    const Vec3 along = normalized(plane.along);
    Vec3 upright = flat_normal(tip);
    upright -= dot(upright, along) * along;
    if (!(norm(upright) > 0)) return std::nullopt;
    TrackPlane side = plane;
    side.motion = (dot(upright, plane.motion) > 0 ? 1 : -1) * normalized(upright);
    side.a = at(tip);
    side.b = at(tip) + plane.along;
    side.c = at(tip) + norm(plane.along) * side.motion;
    return side;
  }

  /// Where no way leads ahead: one along the blade, or down on the other side of a ridge, through what the blade has passed in this move.
  /// `way_on`: the direction so far; without one it is towards the middle of the blade.
  std::optional<Way> leave_beside(V tip, const TrackPlane& plane, Vec3 way_on) const {
    std::optional<Way> best;
    double best_cosine = 0;
    const bool passed_before = passing(plane, at(tip)).time < 0;
    if (!(norm(way_on) > 0)) way_on = (plane.along_blade(at(tip)) < 0.5 ? 1 : -1) * plane.along;
    for_each_way(tip, plane, [&](H h, double f, Vec3 p, Vec3 direction) {
      const double cosine = dot(direction, way_on) / norm(way_on);
      if (cosine <= best_cosine || (passed_before && std::abs(dot(direction, plane.motion)) > kFlat)) return;
      // A lip is no way.
      if ((f < kAlongLip && mesh().is_border(h)) || (f > 1 - kAlongLip && mesh().is_border(CollisionMesh::prev(h)))) return;
      best_cosine = cosine;
      best = way_to(tip, plane, h, f, p);
    });
    return best;
  }

  /// The last strand before a border may be stretched over the edge until its face turns over: the border then lies behind the tip, and the blade, which is past
  /// both, has cut it.
  std::optional<Way> leave_turned_over(V tip, const TrackPlane& plane) const {
    std::optional<Way> out;
    if (!passing(plane, at(tip)).in_blade()) return out;
    const std::vector<Vec3>& rest = mesh().rest.raw();
    const Vec3 lips = slit_at(mesh(), rest, tip).lips;
    for_each_way(tip, plane, [&](H h, double, Vec3, Vec3 direction) {
      const H opposite = CollisionMesh::next(h);
      if (!mesh().is_border(opposite) || mesh().wall[opposite].valid() || dot(direction, plane.motion) > 0) return;
      // Where the strand is thinnest: where the track crosses a face that has turned over says nothing.
      const Vec3 from = rest[tip.index()], a = rest[mesh().to(h).index()], b = rest[mesh().apex(h).index()];
      const double f = std::clamp(dot(from - a, b - a) / dot(b - a, b - a), 0.0, 1.0);
      const Vec3 ahead = lerp(a, b, f) - from;
      if (!(dot(ahead, lips) < -kAhead * norm(ahead) * norm(lips))) return;
      out.emplace();
      out->target.face = mesh().face(h);
      out->target.weights[static_cast<std::size_t>((h.value + 1) % 3)] = 1 - f;
      out->target.weights[static_cast<std::size_t>((h.value + 2) % 3)] = f;
    });
    return out;
  }

  /// Calls fn(half-edge from tip, fraction along the opposite edge, point there, direction) where the track leaves the tip's fan.
  template <class Fn>
  void for_each_way(V tip, const TrackPlane& plane, Fn&& fn) const {
    mesh().for_each_outgoing(tip, [&](H h) {
      const Vec3 a = at(mesh().to(h)), b = at(mesh().apex(h));
      if (plane.above(a) == plane.above(b)) return true;
      const double f = plane.crossing(a, b);
      const Vec3 p = lerp(a, b, f), way = p - at(tip);
      if (norm(way) > 0) fn(h, f, p, normalized(way));
      return true;
    });
  }

  Way way_to(V tip, const TrackPlane& plane, H h, double f, Vec3 p) const {
    Way way;
    const Vec3 p0 = at(tip);
    double u = 1;
    if (plane.progress(p) >= 0) {
      way.inside = true;
      u = std::clamp(plane.progress(p0) / (plane.progress(p0) - plane.progress(p)), 0.0, 1.0);
    }
    const auto cut_up_to = [&](double part) {
      const Passing there = passing(plane, lerp(p0, p, part));
      return there.in_blade() && (there.time >= 0 || dot(p - p0, plane.motion) >= -kFlat * norm(p - p0));
    };
    if (!cut_up_to(u)) {
      double least = 0, most = u;  // the blade's end leaves the material on the way
      for (int i = 0; i < 30; ++i) (cut_up_to(0.5 * (least + most)) ? least : most) = 0.5 * (least + most);
      u = least;
      way.inside = false;
      way.missed = u * norm(p - p0) < feature_;
      way.last = true;
    }
    way.target.face = mesh().face(h);
    std::array<double, 3>& w = way.target.weights;
    w[static_cast<std::size_t>(h.value % 3)] = 1 - u;
    w[static_cast<std::size_t>((h.value + 1) % 3)] = u * (1 - f);
    w[static_cast<std::size_t>((h.value + 2) % 3)] = u * f;
    return way;
  }

  /// A corner at the tip's place, split off from it by a cut, with the track leading on into its material: the other lip of a slit that has a vertex
  /// just there. A path that reaches a slit at such a vertex goes on from one of them, or the slit is open ahead.
  std::optional<V> twin_ahead(V tip) const {
    std::optional<V> found;
    for_each_twin(target_.complex, tip, [&](V twin) {
      if (found || norm(at(twin) - at(tip)) >= feature_) return;
      const auto plane = TrackPlane::make(at(twin), to_);
      if (plane && leave_vertex(twin, *plane, {}, {}, false)) found = twin;
    });
    return found;
  }

  /// The next border that the track meets ahead of `tip`: the other lip of a slit, or a rim further on.
  std::optional<V> enter_next_lip(V tip, const TrackPlane& plane) {
    if (const auto twin = twin_ahead(tip)) return twin;
    const double start = plane.progress(at(tip));
    H found;
    double found_progress = 0, found_f = 0;
    // Back into a lip that it has just come out of is no way; the same place on lips that have moved apart is another.
    const auto at_tip = [&](V v) { return mesh().ancestor[v] == mesh().ancestor[tip] && norm(at(v) - at(tip)) < feature_; };
    const Box3 region = region_ahead(plane, start);
    target_.boxes.refresh(mesh(), target_.position);
    target_.boxes.for_each([&](const Box3& box) { return boxes_meet(box, region); }, [&](F face) {
      for (int k = 0; k < 3; ++k) {
        const H h = CollisionMesh::corner(face, k);
        if (!mesh().is_border(h)) continue;
        const V va = mesh().from(h), vb = mesh().to(h);
        if (at_tip(va) || at_tip(vb)) continue;
        const auto hit = cross_border(h, plane);
        if (!hit) continue;
        if (hit->progress < start - 1e-9 * target_.complex.mean_root_edge || hit->progress > 0) continue;
        if (found.valid() && hit->progress >= found_progress) continue;
        if (met_along(lerp(at(va), at(vb), hit->fraction), false)) continue;
        found = h;
        found_progress = hit->progress;
        found_f = hit->fraction;
      }
    });
    if (!found.valid()) return std::nullopt;
    FacePoint point;
    point.face = mesh().face(found);
    point.weights = {0, 0, 0};
    point.weights[static_cast<std::size_t>(found.value % 3)] = 1 - found_f;
    point.weights[static_cast<std::size_t>((found.value + 1) % 3)] = found_f;
    const auto start_vertex = start_here(point);
    if (!start_vertex || *start_vertex == tip) return std::nullopt;
    if (std::find(entered_.begin(), entered_.end(), *start_vertex) != entered_.end()) return std::nullopt;  // no circles
    entered_.push_back(*start_vertex);
    return start_vertex;
  }

  /// Around all that the blade has passed between a progress and where it goes, along its whole length.
  Box3 region_ahead(const TrackPlane& plane, double start) const {
    const Vec3 base = to_.base - stroke_.edge.base, tip = to_.tip - stroke_.edge.tip;
    // By so much it has moved along itself: what passed a point was elsewhere on the blade then.
    const double slid = std::max(std::abs(dot(base, plane.along)), std::abs(dot(tip, plane.along))) / plane.along_squared + kRounding;
    const double margin = kRounding * target_.complex.mean_root_edge;
    Box3 box;
    for (const double depth : {-slid, 1 + slid})
      for (const double progress : {start - margin, margin}) box.add(plane.origin + depth * plane.along + progress * plane.motion);
    const double wide = kRounding * (norm(box.min) + norm(box.max)) + margin;
    box.min -= Vec3{wide, wide, wide};
    box.max += Vec3{wide, wide, wide};
    return box;
  }

  struct BorderHit { double fraction, progress; };
  /// Where the track crosses border edge h into its face, within the blade's length.
  std::optional<BorderHit> cross_border(H h, const TrackPlane& plane) const {
    const Vec3 a = at(mesh().from(h)), b = at(mesh().to(h)), c = at(mesh().apex(h));
    if (plane.above(a) == plane.above(b)) return std::nullopt;
    const double f = plane.crossing(a, b);
    const Vec3 p = lerp(a, b, f);
    if (!passing(plane, p).in_blade()) return std::nullopt;
    const Vec3 inward = cross(cross(b - a, c - a), b - a);
    if (!(dot(inward, plane.motion) > kLeastProgress * norm(inward))) return std::nullopt;
    return BorderHit{f, plane.progress(p)};
  }

  bool on_a_track(Vec3 p, std::size_t old_fronts) const {
    for (std::size_t i = 0; i < std::min(old_fronts, stroke_.fronts.size()); ++i)
      if (norm(at(stroke_.fronts[i]) - p) < feature_) return true;
    return std::any_of(visited_.begin(), visited_.end(),
                       [&](const std::array<Vec3, 2>& bit) { return distance_to_segment(p, bit[0], bit[1]) < kSameTrack * feature_; }) ||
           met_along(p, false);
  }

  /// A front that has gone along the blade in this move has come by, beside this point only because cuts snap. `from_elsewhere`: it did not
  /// begin here.
  bool met_along(Vec3 p, bool from_elsewhere) const {
    const double near = kBeside * feature_;
    return std::any_of(visited_.begin(), visited_.end(), [&](const std::array<Vec3, 2>& bit) {
      return distance_to_segment(p, bit[0], bit[1]) < near && !(from_elsewhere && norm(p - bit[0]) < near) && is_flat(p, bit[1] - bit[0]);
    });
  }

  /// An entry was found before other fronts cut; find its place on the mesh as it is now.
  std::optional<FacePoint> relocate(const BladeEntry& e) {
    const auto w = weights_in(e.point.face, e.position);
    if (w) return FacePoint{e.point.face, *w};
    const double near = 2 * kOffPlane * target_.complex.mean_root_edge + kRounding * norm(e.position);
    const Box3 region{e.position - Vec3{near, near, near}, e.position + Vec3{near, near, near}};
    target_.boxes.refresh(mesh(), target_.position);
    std::optional<FacePoint> found;
    target_.boxes.for_each([&](const Box3& box) { return !found && boxes_meet(box, region); }, [&](F face) {
      if (found) return;
      if (const auto other = weights_in(face, e.position)) found = FacePoint{face, *other};
    });
    return found;
  }

  /// Barycentric coordinates of a point that lies in (the plane of) a face; none if it lies outside.
  std::optional<std::array<double, 3>> weights_in(F face, Vec3 x) const {
    const H h = CollisionMesh::corner(face, 0);
    const Vec3 a = at(mesh().from(h)), b = at(mesh().to(h)), c = at(mesh().apex(h));
    const Vec3 n = cross(b - a, c - a);
    const double n2 = dot(n, n);
    if (!(n2 > 0)) return std::nullopt;
    if (std::abs(dot(n, x - a)) > kOffPlane * std::sqrt(n2) * target_.complex.mean_root_edge) return std::nullopt;
    const double wa = dot(cross(b - x, c - x), n) / n2, wb = dot(cross(c - x, a - x), n) / n2, wc = 1 - wa - wb;
    if (wa < -1e-9 || wb < -1e-9 || wc < -1e-9) return std::nullopt;
    return std::array<double, 3>{std::max(wa, 0.0), std::max(wb, 0.0), std::max(wc, 0.0)};
  }

  bool touches(V tip, F face) const {
    for (int i = 0; i < 3; ++i)
      if (mesh().from(CollisionMesh::corner(face, i)) == tip) return true;
    return false;
  }

  std::optional<V> start_here(const FacePoint& point) {
    begin_step();
    auto start = start_cut(target_.complex, point, target_.options, target_.scratch);
    if (!start) return refuse(), std::nullopt;
    end_step();
    ++report_.steps;
    return *start;
  }

  /// A step that is refused is tried again a minimum feature to the left and to the right of where it should go, then twice as far.
  std::optional<Advance> advance(V tip, const FacePoint& to) {
    for (const double shift : {0.0, 1.0, -1.0, 2.0, -2.0}) {
      const FacePoint there = shift == 0 ? to : shifted(tip, to, shift * feature_);
      if (!there.face.valid()) continue;
      begin_step();
      auto step = advance_cut(target_.complex, tip, there, target_.options, target_.scratch);
      if (!step) {
        journal_rollback(target_.complex, step_mark_);
        continue;
      }
      end_step();
      ++report_.steps;
      if (shift != 0) ++report_.retried;
      return *step;
    }
    ++report_.refused;
    return std::nullopt;
  }

  /// Where a path from the tip ends that would end at `end` (no face: at the tip): on a border ahead, if that is nearer than the minimum feature. So a
  /// closed stroke ends where it began, as a start so near to a border is on it (start_cut).
  FacePoint joined_end(V tip, const FacePoint& end) const {
    const SlitCorner slit = slit_at(mesh(), target_.position, tip);
    if (slit.ran_out()) return end;
    const Vec3 x = end.face.valid() ? place(end) : at(tip);
    double least = feature_;
    FacePoint joined = end;
    // `f`: along the edge opposite to the tip in the face of `out`, which leaves the tip.
    const auto look_at = [&](H out, double f) {
      const H across = CollisionMesh::next(out);
      const double distance = norm(lerp(at(mesh().from(across)), at(mesh().to(across)), f) - x);
      if (distance >= least) return;
      least = distance;
      joined = {mesh().face(out), {}};
      joined.weights[static_cast<std::size_t>(across.value % 3)] = 1 - f;
      joined.weights[static_cast<std::size_t>((across.value + 1) % 3)] = f;
    };
    mesh().for_each_outgoing(tip, [&](H out) {
      const H across = CollisionMesh::next(out);
      const V a = mesh().from(across), b = mesh().to(across);
      // Not back to where its own lips come from.
      if (mesh().on_border(a) && !mesh().is_border(out) && dot(at(a) - at(tip), slit.lips) <= 0) look_at(out, 0);
      if (!mesh().is_border(across)) return true;
      const double f = dot(x - at(a), at(b) - at(a)) / dot(at(b) - at(a), at(b) - at(a));
      if (f > 0 && f < 1) look_at(out, f);
      return true;
    });
    return joined;
  }

  /// A point moved along the edge opposite to the tip, by `way` metres at the edge itself; no face where it would leave the face.
  FacePoint shifted(V tip, const FacePoint& point, double way) const {
    FacePoint there = point;
    for (int i = 0; i < 3; ++i) {
      const H h = CollisionMesh::corner(point.face, i);
      if (mesh().from(h) != tip) continue;
      double &a = there.weights[static_cast<std::size_t>((i + 1) % 3)], &b = there.weights[static_cast<std::size_t>((i + 2) % 3)];
      const double length = norm(mesh().rest[mesh().apex(h)] - mesh().rest[mesh().to(h)]);
      const double move = (a + b) * way / std::max(length, 1e-300);
      a -= move;
      b += move;
      if (a > 0 && b > 0) return there;
    }
    return {};
  }

  // Around every step: a mark to return to if it is refused.
  void begin_step() {
    journal_mark(target_.complex, step_mark_);
    origin_mark_ = target_.complex.collision.origin.mark();
  }
  void refuse() {
    journal_rollback(target_.complex, step_mark_);
    ++report_.refused;
  }
  void end_step() {
    mesh().origin.for_each_changed(origin_mark_, [&](H h) { target_.boxes.mark(CollisionMesh::face(h)); });
    for (std::size_t i = target_.position.size(); i < mesh().vertex_count(); ++i)
      target_.position.push_back(place(V(i)));
  }
  Vec3 place(const FacePoint& p) const {
    Vec3 x;
    for (int i = 0; i < 3; ++i) x += p.weights[static_cast<std::size_t>(i)] * at(mesh().from(CollisionMesh::corner(p.face, i)));
    return x;
  }
  /// New vertices lie among their parents as they do at rest.
  Vec3 place(V v) const {
    const auto& births = target_.scratch.births;
    const auto birth = std::lower_bound(births.begin(), births.end(), v,
                                        [](const VertexBirth& b, V id) { return b.vertex < id; });
    KERF_ASSERT(birth != births.end() && birth->vertex == v);
    Vec3 p;
    for (std::size_t i = 0; i < 3; ++i)
      if (birth->parent[i].valid()) p += birth->weight[i] * at(birth->parent[i]);
    return p;
  }

  BladeStroke& stroke_;
  SweepTarget& target_;
  SweepReport report_;
  double feature_ = 0;
  bool redone_ = false;
  bool first_pose_ = false;    // the edge stands where it was put down
  BladeEdge to_;
  std::vector<Front> fronts_;  // of the new pose
  std::vector<Vec3> ends_;     // where fronts were at the last pose, provisional ends included
  std::vector<std::array<Vec3, 2>> visited_;  // bits of tracks
  std::vector<V> entered_;
  std::vector<V> joined_;  // where a path has run into a border: it fell apart
  JournalMark step_mark_;
  Journaled<H, V>::Mark origin_mark_;
};

double turn(const BladeEdge& a, const BladeEdge& b) {
  const Vec3 da = normalized(a.tip - a.base), db = normalized(b.tip - b.base);
  return std::acos(std::clamp(dot(da, db), -1.0, 1.0));
}

}  // namespace

Result<SweepReport> move_blade(BladeStroke& stroke, const BladeEdge& edge, SweepTarget& target) {
  if (!is_finite(edge.base) || !is_finite(edge.tip)) return bad_input("blade: a coordinate of the edge is not a number");
  if (!(norm(edge.tip - edge.base) > 0))
    return bad_input("blade: base and tip are the same point; a blade needs an edge of some length");
  SweepReport total;
  if (!stroke.started) {
    stroke.started = stroke.standing = true;
    stroke.edge = edge;
    return total;
  }
  const BladeEdge from = stroke.edge;
  const int parts = std::clamp(static_cast<int>(std::ceil(turn(from, edge) / kMaxTurn)), 1, 64);
  for (int i = 1; i <= parts; ++i) {
    const double t = static_cast<double>(i) / parts;
    const BladeEdge to = i == parts ? edge : BladeEdge{lerp(from.base, edge.base, t), lerp(from.tip, edge.tip, t)};
    if (!(norm(to.tip - to.base) > 0)) continue;
    const SweepReport part = Sweep(stroke, target).run(to);
    total.steps += part.steps;
    total.refused += part.refused;
    total.retried += part.retried;
    total.changed |= part.changed;
  }
  return total;
}

void lift_blade(BladeStroke& stroke) {
  stroke.started = stroke.standing = false;
  stroke.fronts.clear();
  stroke.ways.clear();
  stroke.committed.clear();
  stroke.committed_ways.clear();
  stroke.trail.clear();
  stroke.last_bits.clear();
  stroke.provisional = false;
}

}  // namespace kerf
