#include "kerf/geodesic/exact_windows.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kerf/base/check.h"
#include "kerf/geodesic/tolerances.h"

namespace kerf {
namespace {

using Window = ExactSearch::Window;
using Corner = ExactSearch::Corner;
using Event = ExactSearch::Event;

bool later(const Event& a, const Event& b) {
  if (a.estimate != b.estimate) return a.estimate > b.estimate;
  return a.window != b.window ? a.window > b.window : a.corner > b.corner;
}

class Propagation {
 public:
  Propagation(const PathQuery& query, double upper_bound, ExactSearch& scratch)
      : q_(query), m_(query.surface), w_(scratch), target_(m_.at(query.t)), bound_(upper_bound * (1 - kExactGain)) {
    w_.corner_index.clear();
    w_.tip_index.clear();
    w_.corners.clear();
    w_.tips.clear();
    w_.windows.clear();
    w_.heap.clear();
  }

  ExactOutcome run() {
    start();
    while (!w_.heap.empty()) {
      std::pop_heap(w_.heap.begin(), w_.heap.end(), later);
      const Event event = w_.heap.back();
      w_.heap.pop_back();
      if (!(event.estimate < bound_)) break;
      if (w_.windows.size() > static_cast<std::size_t>(kMaxWindows)) return ExactOutcome::kGaveUp;
      if (event.window >= 0) propagate(event.window);
      else if (event.distance == w_.corners[at(event.corner)].distance) emit_around(event.corner);
    }
    return goal_ >= 0 ? ExactOutcome::kShorter : ExactOutcome::kNoShorter;
  }

  // The crossings from s to the goal, corner by corner.
  void trace(Strip& strip) {
    strip.clear();
    w_.route.clear();
    std::int32_t guard = static_cast<std::int32_t>(w_.corners.size());
    for (std::int32_t c = goal_; c >= 0 && guard-- >= 0; c = previous(c)) w_.route.push_back(c);
    std::reverse(w_.route.begin(), w_.route.end());
    for (std::size_t i = 1; i < w_.route.size(); ++i) {
      const Corner& to = w_.corners[at(w_.route[i])];
      const std::size_t first = strip.size();
      std::int32_t exit_face = to.face;
      for (std::int32_t k = to.window; k >= 0; k = w_.windows[at(k)].parent) {
        strip.push_back(w_.windows[at(k)].half_edge);
        exit_face = strip.back() / 3;
      }
      std::reverse(strip.begin() + static_cast<std::ptrdiff_t>(first), strip.end());
      if (i == 1) continue;  // s: the strip starts in the exit face
      const Corner& from = w_.corners[at(w_.route[i - 1])];
      turn_.clear();
      turn(from.vertex, from.face, exit_face);
      strip.insert(strip.begin() + static_cast<std::ptrdiff_t>(first), turn_.begin(), turn_.end());
    }
    reduced_.clear();
    for (std::int32_t h : strip) append_crossing(m_, reduced_, h);
    strip.swap(reduced_);
  }

 private:
  static std::size_t at(std::int32_t i) { return static_cast<std::size_t>(i); }
  [[nodiscard]] double length(std::int32_t h) const { return norm(m_.at(m_.to(h)) - m_.at(m_.from(h))); }

  [[nodiscard]] std::int32_t previous(std::int32_t corner) const {
    const Corner& c = w_.corners[at(corner)];
    return c.window >= 0 ? w_.windows[at(c.window)].root : c.before;
  }

  // The clockwise end of a corner, as outgoing half-edge; any fixed half-edge when no wall meets the vertex.
  [[nodiscard]] std::int32_t clockwise_end(std::int32_t outgoing) const {
    const std::int32_t v = m_.from(outgoing);
    if (q_.free(v)) return m_.outgoing[at(v)];
    std::int32_t h = outgoing;
    while (q_.passable(h)) {
      h = rotate_cw(m_, h);
      if (h == outgoing) return m_.outgoing[at(v)];
    }
    return h;
  }

  // Calls visit(h) for the outgoing half-edges of the corner, counter-clockwise from its end.
  template <class Visit>
  void for_each_in_corner(std::int32_t vertex_end, Visit&& visit) const {
    std::int32_t h = vertex_end;
    do {
      visit(h);
      if (!q_.passable(WalledSurface::prev(h))) return;
      h = rotate_ccw(m_, h);
    } while (h != vertex_end);
  }

  // Number of the corner of a face at the origin of one of its half-edges.
  std::int32_t corner_of(std::int32_t outgoing) {
    const std::int32_t end = clockwise_end(outgoing);
    const std::int32_t known = w_.corner_index.size(), number = w_.corner_index.insert(end);
    if (number != known) return number;
    const std::int32_t v = m_.from(outgoing);
    double angle = 0;
    for_each_in_corner(end, [&](std::int32_t h) {
      const Vec3 a = m_.at(m_.to(h)) - m_.at(v), b = m_.at(m_.apex(h)) - m_.at(v);
      angle += std::atan2(norm(cross(a, b)), dot(a, b));
    });
    const bool cut = !q_.passable(end);
    const bool bends = angle > (cut ? 1 : 2) * std::numbers::pi + kBendAngle;
    w_.corners.push_back({v, -1, HUGE_VAL, -1, -1, bends});
    return number;
  }

  void push(Event event) {
    w_.heap.push_back(event);
    std::push_heap(w_.heap.begin(), w_.heap.end(), later);
  }

  // A path to the corner of `outgoing` of this length has been found.
  void reach(std::int32_t outgoing, double distance, std::int32_t window, std::int32_t before) {
    if (!(distance < bound_)) return;
    const std::int32_t number = corner_of(outgoing);
    Corner& corner = w_.corners[at(number)];
    if (!(distance < corner.distance)) return;
    // Between walls t can have other corners, around which a path may bend like around any other.
    const bool arrived = corner.vertex == q_.t && q_.in_sector(q_.t, q_.at_t, outgoing);
    if (arrived) {
      goal_ = number;
      bound_ = distance;
    }
    corner.distance = distance;
    corner.window = window;
    corner.before = before;
    corner.face = outgoing / 3;
    if (corner.bends && !arrived) push({distance + norm(m_.at(corner.vertex) - target_), distance, -1, number});
  }

  void start() {
    for_each_in_sector(m_, q_.s, q_.at_s, [&](std::int32_t h) {
      const std::int32_t number = corner_of(h);  // with walls but no sector, s has several corners
      w_.corners[at(number)].distance = 0;
      emit(h, number);
      return true;
    });
  }

  void emit_around(std::int32_t number) {
    const Corner corner = w_.corners[at(number)];
    std::int32_t h = WalledSurface::next(3 * corner.face);
    for (int k = 0; k < 3 && m_.from(h) != corner.vertex; ++k) h = WalledSurface::next(h);
    for_each_in_corner(clockwise_end(h), [&](std::int32_t outgoing) { emit(outgoing, number); });
  }

  // From the corner through the face of its outgoing half-edge h.
  void emit(std::int32_t h, std::int32_t number) {
    const double distance = w_.corners[at(number)].distance;
    const std::int32_t across = WalledSurface::next(h), v = m_.from(h);
    const Vec3 p = m_.at(v), a = m_.at(m_.to(h)), b = m_.at(m_.apex(h));
    reach(across, distance + norm(a - p), -1, number);
    reach(WalledSurface::prev(h), distance + norm(b - p), -1, number);
    if (!q_.passable(across)) return;
    const double edge = norm(b - a);
    if (!(edge > 0)) return;
    const Vec3 u = (1 / edge) * (b - a);
    const Vec2 source{dot(p - a, u), norm(cross(u, p - a))};
    if (far_from_ends(source, distance, 0, edge, edge, corner_of(across), corner_of(WalledSurface::prev(h)))) return;
    add({across, -1, number, 0, edge, source, distance});
  }

  void add(const Window& window) {
    // The least length over this window: t turned about the edge into the plane, then a straight line, if it can.
    const Vec3 from = m_.at(m_.from(window.half_edge)), edge = m_.at(m_.to(window.half_edge)) - from;
    const double size = norm(edge);
    const Vec3 u = (1 / size) * edge, rest = target_ - from;
    const double along = dot(rest, u), away = norm(cross(u, rest)), depth = window.source.y + away;
    const double line = depth > 0 ? window.source.x + (along - window.source.x) * window.source.y / depth : along;
    const double x = std::clamp(line, window.begin, window.end);
    const double estimate = window.offset + norm(window.source - Vec2{x, 0}) + norm(Vec2{along - x, away});
    if (!(estimate < bound_)) return;
    const auto number = static_cast<std::int32_t>(w_.windows.size());
    w_.windows.push_back(window);
    push({estimate, 0, number, -1});
  }

  // Is every point of the part reached at least as well over one end of the edge? (Xin and Wang 2009, theorem 3.2)
  [[nodiscard]] bool far_from_ends(Vec2 source, double offset, double begin, double end, double edge, std::int32_t from,
                                   std::int32_t to) const {
    const double to_end = offset + norm(source - Vec2{end, 0});
    const double to_begin = offset + norm(source - Vec2{begin, 0});
    return to_end > (w_.corners[at(from)].distance + end) * (1 + kSameLength) ||
           to_begin > (w_.corners[at(to)].distance + (edge - begin)) * (1 + kSameLength);
  }

  void propagate(std::int32_t number) {
    const Window window = w_.windows[at(number)];
    const std::int32_t e = window.half_edge, g = m_.opposite(e);
    const std::int32_t right_edge = WalledSurface::next(g), left_edge = WalledSurface::prev(g);
    const double base = length(e), right = length(right_edge), left = length(left_edge);
    const std::int32_t at_right = corner_of(right_edge), at_left = corner_of(g), at_tip = corner_of(left_edge);
    // Closer ways to the ends may have come up while it waited.
    if (far_from_ends(window.source, window.offset, window.begin, window.end, base, at_right, at_left)) return;

    const Vec3 origin = m_.at(m_.from(e)), u3 = (1 / base) * (m_.at(m_.to(e)) - origin),
               tip3 = m_.at(m_.apex(g)) - origin;
    const Vec2 tip{dot(tip3, u3), -norm(cross(u3, tip3))}, source = window.source;
    const double slack = kWindowWidth * base, depth = source.y - tip.y;
    const double crossing = depth > 0 ? source.x + (tip.x - source.x) * source.y / depth : source.x;

    bool to_right = crossing > window.begin + slack, to_left = crossing < window.end - slack;
    if (crossing > window.begin - slack && crossing < window.end + slack) {
      const double distance = window.offset + norm(source - tip);
      const std::int32_t known = w_.tip_index.size(), tip_number = w_.tip_index.insert(e);
      if (tip_number == known) w_.tips.push_back({HUGE_VAL, 0});
      ExactSearch::Tip& best = w_.tips[at(tip_number)];
      if (distance < best.distance) best = {distance, crossing};
      else if (distance > best.distance * (1 + kSameLength)) {
        // One angle, one split: beyond the better line to the tip this window can't give shortest paths.
        if (crossing > best.crossing + slack) to_right = false;
        if (crossing < best.crossing - slack) to_left = false;
      }
      reach(left_edge, distance, number, -1);
    }
    const Vec2 base_right{}, base_left{base, 0};
    if (to_right && q_.passable(right_edge))
      child({number, right_edge, base_right, tip, base_left, right, at_right, at_tip, at_left, true}, window,
            window.begin, std::min(crossing, window.end), crossing <= window.end);
    if (to_left && q_.passable(left_edge))
      child({number, left_edge, tip, base_left, base_right, left, at_tip, at_left, at_right, false}, window,
            std::max(crossing, window.begin), window.end, crossing >= window.begin);
  }

  // Where the lines of a window leave the face they entered: through half_edge, from a to b in the plane of the parent;
  // the third corner of the face is c.
  struct Exit {
    std::int32_t parent, half_edge;
    Vec2 a, b, c;
    double edge;
    std::int32_t at_a, at_b, at_c;
    bool right;  // the edge the lines came through shares a with this one, else b
  };

  // The lines through [begin, end] of the parent's edge; `whole`: they go up to the tip.
  void child(const Exit& exit, const Window& parent, double begin, double end, bool whole) {
    const double edge = exit.edge, offset = parent.offset;
    if (!(edge > 0)) return;
    const Vec2 u = (1 / edge) * (exit.b - exit.a);
    const auto turned = [&](Vec2 p) { return Vec2{dot(u, p - exit.a), cross(u, p - exit.a)}; };
    const Vec2 source = turned(parent.source);
    if (!(source.y > 0)) return;
    const auto project = [&](double x, double otherwise) {
      const Vec2 p = turned({x, 0});
      const double depth = source.y - p.y;
      if (!(depth > 0)) return otherwise;
      return std::clamp(source.x + (p.x - source.x) * source.y / depth, 0.0, edge);
    };
    const double first = whole && !exit.right ? 0 : project(begin, 0);
    const double last = whole && exit.right ? edge : project(end, edge);
    if (!(last - first > kWindowWidth * edge)) return;
    if (far_from_ends(source, offset, first, last, edge, exit.at_a, exit.at_b)) return;
    // Third test: over the corner opposite, at the end of the part that is nearer to the edge the lines came through.
    const double near = exit.right ? first : last;
    const double over_corner = w_.corners[at(exit.at_c)].distance + norm(turned(exit.c) - Vec2{near, 0});
    if (offset + norm(source - Vec2{near, 0}) > over_corner * (1 + kSameLength)) return;
    add({exit.half_edge, exit.parent, parent.root, first, last, source, offset});
  }

  // Crossings around v from one face of a corner to another.
  void turn(std::int32_t v, std::int32_t from_face, std::int32_t to_face) {
    if (from_face == to_face) return;
    std::int32_t start = 3 * from_face;
    for (int k = 0; k < 2 && m_.from(start) != v; ++k) start = WalledSurface::next(start);
    for (const bool ccw : {true, false}) {
      turn_.clear();
      std::int32_t h = start;
      do {
        const std::int32_t crossed = ccw ? WalledSurface::prev(h) : h;
        if (!q_.passable(crossed)) break;
        turn_.push_back(crossed);
        h = ccw ? rotate_ccw(m_, h) : rotate_cw(m_, h);
        if (h / 3 == to_face) return;
      } while (h != start);
    }
    KERF_ASSERT(false);  // both faces belong to one corner
  }

  const PathQuery& q_;
  const WalledSurface& m_;
  ExactSearch& w_;
  Vec3 target_;
  double bound_;
  std::int32_t goal_ = -1;
  Strip turn_, reduced_;
};

}  // namespace

ExactOutcome search_exact(const PathQuery& query, double upper_bound, Strip& strip, ExactSearch& scratch) {
  Propagation propagation(query, upper_bound, scratch);
  const ExactOutcome outcome = propagation.run();
  if (outcome == ExactOutcome::kShorter) propagation.trace(strip);
  if (scratch.windows.capacity() > static_cast<std::size_t>(kKeptWindows)) {
    scratch.windows = {};
    scratch.heap = {};
  }
  return outcome;
}

}  // namespace kerf
