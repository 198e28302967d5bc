#include "kerf/cutting/path_opening.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "kerf/base/at.h"
#include "kerf/cutting/collision_split.h"
#include "kerf/cutting/crumb.h"
#include "kerf/cutting/tolerances.h"
#include "kerf/cutting/unlink.h"

namespace kerf {

using V = CollisionVertex;
using H = CollisionHalfEdge;
using F = CollisionTriangle;
using Stop = CutStop;

bool PathOpening::divided(F f) const { return std::find(divided_.begin(), divided_.end(), f) != divided_.end(); }

bool PathOpening::open(std::span<const Stop> stops, std::span<const Vec3> drawn, bool closed) {
  const UncutPath uncut = attempt(stops, drawn, closed);
  if (uncut.reason == UncutReason::kNone || only_crumbs_) return uncut.reason == UncutReason::kNone;
  ++refused_;
  if (uncut_.reason == UncutReason::kNone) uncut_ = uncut;
  return false;
}

bool PathOpening::open_if_possible(std::span<const Stop> stops, std::span<const Vec3> drawn) {
  return attempt(stops, drawn, false).reason == UncutReason::kNone;
}

UncutPath PathOpening::attempt(std::span<const Stop> stops, std::span<const Vec3> drawn, bool closed) {
  begin();
  ground_.cut.drawn = drawn;
  const std::size_t flips = ground_.cut.scratch.flip_stack.size();
  made_.clear();
  divisions_.clear();
  UncutReason reason = UncutReason::kNone;
  Vec3 at;
  // A point inside goes first where the path begins on the border of its face: it is a corner of all parts then.
  V inside;
  if (stops.size() > 1 && stops[0].border(mesh()).valid() && stops[0].kind == Stop::Kind::kEdge &&
      stops[1].kind == Stop::Kind::kInside) {
    inside = make(stops[1], V{});
    if (!inside.valid()) reason = UncutReason::kNoVertex, at = stops[1].place(mesh());
  }
  for (std::size_t i = 0; i < stops.size() && reason == UncutReason::kNone; ++i) {
    const V v = closed && i + 1 == stops.size() ? made_.front()
                : i == 1 && inside.valid()      ? inside
                                                : make(stops[i], made_.empty() ? V{} : made_.back());
    if (!v.valid()) reason = UncutReason::kNoVertex, at = stops[i].place(mesh());
    else if (made_.empty() || made_.back() != v) made_.push_back(v);
  }
  if (reason == UncutReason::kNone) {
    reason = open_made();
    at = mesh().rest[made_[made_.size() / 2]];
  }
  only_crumbs_ = reason == UncutReason::kCrumbs;
  if (reason != UncutReason::kNone) {
    journal_rollback(ground_.cut.body, mark_);
    ground_.cut.scratch.flip_stack.resize(std::min(flips, ground_.cut.scratch.flip_stack.size()));
  } else {
    end();
  }
  return {reason, at};
}

UncutReason PathOpening::open_made() {
  edges_.clear();
  for (std::size_t i = 0; i + 1 < made_.size(); ++i) {
    H h = mesh().find_half_edge(made_[i], made_[i + 1]);
    if (!h.valid()) h = mesh().find_half_edge(made_[i + 1], made_[i]);
    if (!h.valid()) return UncutReason::kNoEdge;
    if (!mesh().is_border(h)) edges_.push_back(h);
  }
  // A slit of one edge would have both lips between the same two vertices.
  if (edges_.size() == 1 && !mesh().on_border(mesh().from(edges_[0])) && !mesh().on_border(mesh().to(edges_[0]))) {
    if (!mesh().has_chain(edges_[0]) && !cut::make_chains(ground_.cut, edges_[0])) return UncutReason::kPinch;
    const V end = mesh().to(edges_[0]),
            middle = cut::split_collision_edge(ground_.cut, edges_[0], far_enough(edges_[0], 0.5));
    if (!middle.valid()) return UncutReason::kNoVertex;
    edges_.push_back(mesh().find_half_edge(middle, end));
  }
  return unlink_all();
}

double PathOpening::made_length() const {
  double sum = 0;
  for (std::size_t i = 0; i + 1 < made_.size(); ++i) sum += norm(mesh().rest[made_[i + 1]] - mesh().rest[made_[i]]);
  return sum;
}

/// The edges of the path, but for those that hold a crumb: what lies beyond it is parted from the body by the crumb's other sides. A short path that holds
/// one is not made, so that strands do not fill with vertices.
UncutReason PathOpening::unlink_all() {
  const auto roll_back = [&](const JournalMark& mark, std::size_t flips) {
    journal_rollback(ground_.cut.body, mark);
    ground_.cut.scratch.flip_stack.resize(std::min(flips, ground_.cut.scratch.flip_stack.size()));
  };
  const bool was_empty = edges_.empty();
  JournalMark whole;
  journal_mark(ground_.cut.body, whole);
  const std::size_t flips = ground_.cut.scratch.flip_stack.size();
  for (;;) {
    twins_.clear();
    bool is_held = false;
    for (std::size_t i = 0; i < edges_.size();) {
      const H h = edges_[i], twin = mesh().twin[h];
      if (!twin.valid()) {  // the path comes twice along it
        edges_.erase(edges_.begin() + static_cast<std::ptrdiff_t>(i));
        continue;
      }
      JournalMark before;
      journal_mark(ground_.cut.body, before);
      const std::size_t flips_before = ground_.cut.scratch.flip_stack.size();
      if (!cut::unlink_edge(ground_.cut, h)) return UncutReason::kPinch;
      if (is_in_crumb(ground_.cut.body, std::array{CollisionMesh::face(h), CollisionMesh::face(twin)},
                      cut::kCrumbWidth * feature_, ground_.cut.scratch)) {
        is_held = true;
        roll_back(before, flips_before);
        edges_.erase(edges_.begin() + static_cast<std::ptrdiff_t>(i));
        continue;
      }
      twins_.push_back(twin);
      ++i;
    }
    if (!is_held) break;
    const double short_path =
        std::min(cut::kCrumbPath * feature_, cut::kMostCrumbPath * ground_.cut.body.mean_root_edge);
    if (made_length() < short_path) return UncutReason::kCrumbs;
    // What an edge that stays has left alone would have both lips between the same two vertices.
    std::size_t kept = 0;
    for (std::size_t i = 0; i < edges_.size(); ++i)
      if (mesh().from(edges_[i]) != mesh().to(twins_[i]) || mesh().to(edges_[i]) != mesh().from(twins_[i]))
        edges_[kept++] = edges_[i];
    if (kept == edges_.size()) break;
    edges_.resize(kept);
    roll_back(whole, flips);
  }
  if (edges_.empty() && !was_empty) return UncutReason::kCrumbs;
  opened_ += static_cast<int>(edges_.size());
  return UncutReason::kNone;
}

void PathOpening::turn_edges(std::span<const F> keep) {
  begin();
  cut::flip_to_delaunay(ground_.cut, keep);
  end();
}

V PathOpening::make(const Stop& s, V before) {
  switch (s.kind) {
    case Stop::Kind::kVertex: return s.vertex;
    case Stop::Kind::kEdge: return make_on_edge(s);
    case Stop::Kind::kInside: return make_inside(s.point, before);
    case Stop::Kind::kNone: break;
  }
  return {};
}

/// On the edge, or on what earlier stops of the path have left of it.
V PathOpening::make_on_edge(const Stop& s) {
  Division low{s.a, s.b, 0, s.a}, high{s.a, s.b, 1, s.b};
  for (const Division& d : divisions_) {
    if (d.a != s.a || d.b != s.b) continue;
    if (d.fraction <= s.fraction && d.fraction >= low.fraction) low = d;
    if (d.fraction > s.fraction && d.fraction < high.fraction) high = d;
  }
  const H h = mesh().find_half_edge(low.vertex, high.vertex);
  if (!h.valid()) return {};
  const V v = split(h, (s.fraction - low.fraction) / (high.fraction - low.fraction));
  if (v.valid()) divisions_.push_back({s.a, s.b, s.fraction, v});
  return v;
}

/// Inside a face that the vertex before is a corner of: at a corner or on an edge if near, but on no border that the path does not reach.
V PathOpening::make_inside(RestPoint p, V before) {
  if (!find_face(mesh(), p, before, outside_) || (before.valid() && !has_corner(mesh(), p.face, before))) return {};
  const NearInFace near = near_in_face(mesh(), p, feature_, before);
  if (near.corner.valid()) return near.corner;
  if (near.edge.valid()) {
    const double margin = std::min(0.5, feature_ / length(near.edge));
    return split(near.edge, std::clamp(near.fraction, margin, 1 - margin));
  }
  divided_.push_back(p.face);
  return cut::split_collision_face(ground_.cut, p.face, p.at, weights_of(mesh(), p));
}

double PathOpening::far_enough(H h, double fraction) const {
  const double least = cut::kLeastCollisionEdge * feature_, far = length(h);
  const H twin = mesh().twin[h];
  const Vec3 a = mesh().rest[mesh().from(h)], b = mesh().rest[mesh().to(h)];
  const Vec3 apexes[2] = {mesh().rest[mesh().apex(h)], mesh().rest[mesh().apex(twin.valid() ? twin : h)]};
  const auto has_room = [&](double t) {
    return t * far >= least && (1 - t) * far >= least &&
           std::all_of(std::begin(apexes), std::end(apexes), [&](Vec3 c) { return norm(lerp(a, b, t) - c) >= least; });
  };
  if (has_room(fraction)) return fraction;
  double best = fraction, off = HUGE_VAL;
  const auto consider = [&](double t) {
    if (std::fabs(t - fraction) < off && has_room(t)) best = t, off = std::fabs(t - fraction);
  };
  constexpr double kOver = 1 + 1e-6;  // so that rounding leaves it far enough
  consider(kOver * least / far);
  consider(1 - kOver * least / far);
  for (const Vec3 c : apexes) {
    const double foot = dot(c - a, b - a) / (far * far), height = norm(c - lerp(a, b, foot));
    if (height >= least) continue;
    const double by = kOver * std::sqrt(least * least - height * height) / far;
    consider(foot - by);
    consider(foot + by);
  }
  return best;
}

/// There or, if that is refused, one or two minimum features beside it, each as far from other vertices as there is room; at last, there as it is.
V PathOpening::split(H h, double fraction) {
  const double shift = feature_ / length(h);
  divided_.push_back(CollisionMesh::face(h));
  if (const H t = mesh().twin[h]; t.valid()) divided_.push_back(CollisionMesh::face(t));
  const auto try_at = [&](double there) {
    JournalMark mark;
    journal_mark(ground_.cut.body, mark);
    const std::size_t flips = ground_.cut.scratch.flip_stack.size();
    const V v = cut::split_collision_edge(ground_.cut, h, there);
    if (v.valid()) return v;
    journal_rollback(ground_.cut.body, mark);
    ground_.cut.scratch.flip_stack.resize(flips);
    return V{};
  };
  for (const double by : {0.0, 1.0, -1.0, 2.0, -2.0}) {
    const double there = fraction + by * shift;
    if (by != 0 && !(there > 0.5 * shift && there < 1 - 0.5 * shift)) continue;
    if (const V v = try_at(far_enough(h, there)); v.valid()) {
      if (by != 0) ++retried_;
      return v;
    }
  }
  return far_enough(h, fraction) == fraction ? V{} : try_at(fraction);
}

void PathOpening::begin() {
  journal_mark(ground_.cut.body, mark_);
  origin_mark_ = mesh().origin.mark();
}
/// New vertices lie among their parents as they do at rest.
void PathOpening::end() {
  mesh().origin.for_each_changed(origin_mark_, [&](H h) { ground_.boxes.mark(CollisionMesh::face(h)); });
  const auto& births = ground_.cut.scratch.births;
  for (std::size_t i = ground_.position.size(); i < mesh().vertex_count(); ++i) {
    const auto birth =
        std::lower_bound(births.begin(), births.end(), V(i), [](const VertexBirth& b, V id) { return b.vertex < id; });
    KERF_ASSERT(birth != births.end() && birth->vertex == V(i));
    const auto append_to = [&](std::vector<Vec3>& places) {
      Vec3 p;
      for (std::size_t k = 0; k < 3; ++k)
        if (birth->parent[k].valid()) p += birth->weight[k] * places[birth->parent[k].index()];
      places.push_back(p);
    };
    append_to(ground_.position);
    for (std::vector<Vec3>* other : ground_.others) append_to(*other);
  }
}

}  // namespace kerf
