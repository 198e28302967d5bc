#include "kerf/binding/flat_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <queue>
#include <vector>

#include "kerf/base/at.h"
#include "kerf/binding/tolerances.h"

namespace kerf {
namespace {

class FlatParts {
 public:
  FlatParts(SplitSurface& s, double limit) : s_(s), w_(s.walled), limit_(limit) {}

  /// Marks the faces of flat parts that have a thin triangle with an inner edge longer than `spoke`; false if there are none.
  bool find(double spoke) {
    std::vector<std::int32_t> stack;
    for (std::int32_t h = 0; h < half_edges(); ++h) {
      if (w_.opposite(h) < h || !(length(h) > spoke)) continue;
      if (!(is_thin(h / 3) || is_thin(w_.opposite(h) / 3)) || !is_flat(h)) continue;
      if (part_.empty()) part_.assign(s_.parent.size(), 0);
      const auto mark = [&](std::int32_t f) {
        if (part_[at(f)]) return;
        part_[at(f)] = 1;
        stack.push_back(f);
      };
      mark(h / 3);
      while (!stack.empty()) {
        const std::int32_t f = stack.back();
        stack.pop_back();
        for (std::int32_t k = 3 * f; k < 3 * f + 3; ++k)
          if (is_flat(k)) mark(w_.opposite(k) / 3);
      }
    }
    return !part_.empty();
  }

  /// What is part of a marked face.
  void mark_children() {
    part_.reserve(s_.parent.size());
    for (const std::int32_t p : s_.parent) part_.push_back(s_.flat[at(p)]);
  }
  std::vector<std::uint8_t> take_marks() { return std::move(part_); }

  void make_delaunay() {
    for (std::int32_t h = half_edges(); h-- > 0;)
      if (w_.opposite(h) > h && part_[at(h / 3)]) doubtful_.push_back(h);
    flip_doubtful();
  }

  void halve(std::size_t most_faces) {
    for (std::int32_t h = 0; h < half_edges(); ++h)
      if (w_.opposite(h) < h) offer(h);
    while (!long_.empty() && s_.parent.size() < most_faces) {
      const Long e = long_.top();
      long_.pop();
      if (w_.opposite(e.h) > e.h || length(e.h) != e.length || !concerns(e.h))
        continue;  // the number stands for another edge by now
      const std::int32_t g = w_.opposite(e.h);
      const std::int32_t m = split_edge(s_, e.h, 0.5);
      part_.push_back(part_[at(e.h / 3)]);
      if (g >= 0) part_.push_back(part_[at(g / 3)]);
      const std::int32_t start = fan_start(w_, m);
      std::int32_t h = start;
      do {
        touch(h / 3);
        h = ccw(w_, h);
      } while (h >= 0 && h != start);
      flip_doubtful();
    }
  }

 private:
  struct Long {
    double length;
    std::int32_t h;
    friend bool operator<(const Long& a, const Long& b) {
      return a.length != b.length ? a.length < b.length : a.h > b.h;
    }
  };

  [[nodiscard]] std::int32_t half_edges() const { return static_cast<std::int32_t>(w_.origin.size()); }
  [[nodiscard]] double length(std::int32_t h) const { return norm(w_.at(w_.to(h)) - w_.at(w_.from(h))); }
  [[nodiscard]] double longest_of(std::int32_t f) const {
    return std::max({length(3 * f), length(3 * f + 1), length(3 * f + 2)});
  }
  /// Twice the area, along the normal.
  [[nodiscard]] Vec3 area(std::int32_t f) const {
    const Vec3 a = w_.at(w_.from(3 * f));
    return cross(w_.at(w_.from(3 * f + 1)) - a, w_.at(w_.from(3 * f + 2)) - a);
  }
  [[nodiscard]] bool is_thin(std::int32_t f) const {
    const double longest = longest_of(f);
    return norm(area(f)) < kThinHeight * longest * longest;
  }

  /// Do the faces of this edge lie in one plane, with one texture map?
  [[nodiscard]] bool is_flat(std::int32_t h) const {
    const std::int32_t g = w_.opposite(h);
    if (g < 0) return false;
    const Vec3 n = area(h / 3), m = area(g / 3), a = w_.at(w_.from(h)), c = w_.at(w_.apex(h)), d = w_.at(w_.apex(g));
    const double off = kFlatOff * std::max(longest_of(h / 3), longest_of(g / 3));
    if (!(dot(n, m) > 0) || std::fabs(dot(d - a, n)) > off * norm(n) || std::fabs(dot(c - a, m)) > off * norm(m))
      return false;
    if (s_.texture.empty()) return true;
    const auto uv = [&](std::int32_t k) { return Vec2{s_.texture[at(k)].x, s_.texture[at(k)].y}; };
    const std::int32_t hn = WalledSurface::next(h), gn = WalledSurface::next(g);
    const auto apart = [](Vec2 p, Vec2 q) {
      return std::max(std::fabs(p.x - q.x), std::fabs(p.y - q.y)) > kFlatTexture;
    };
    const Vec3 b = w_.at(w_.to(h));
    const double wb = dot(cross(d - a, c - a), n) / dot(n, n), wc = dot(cross(b - a, d - a), n) / dot(n, n);
    const Vec2 ua = uv(h), ub = uv(hn), uc = uv(WalledSurface::prev(h));
    return !apart(ua, uv(gn)) && !apart(ub, uv(g)) &&
           !apart(ua + wb * (ub - ua) + wc * (uc - ua), uv(WalledSurface::prev(g)));
  }

  [[nodiscard]] bool concerns(std::int32_t h) const {
    return part_[at(h / 3)] || (w_.opposite(h) >= 0 && part_[at(w_.opposite(h) / 3)]);
  }
  void offer(std::int32_t h) {
    h = std::max(h, w_.opposite(h));
    if (concerns(h) && length(h) > limit_) long_.push({length(h), h});
  }
  /// The edges of a face that changed.
  void touch(std::int32_t f) {
    for (std::int32_t k = 3 * f; k < 3 * f + 3; ++k) {
      offer(k);
      doubtful_.push_back(k);
    }
  }

  void flip_doubtful() {
    while (!doubtful_.empty()) {
      const std::int32_t h = doubtful_.back();
      doubtful_.pop_back();
      if (!should_flip(h)) continue;
      const std::int32_t g = w_.opposite(h);
      flip_edge(s_, h);
      touch(h / 3);
      touch(g / 3);
    }
  }

  /// Is the edge inside a flat part and not Delaunay, and does the other diagonal of its quad not exist yet?
  [[nodiscard]] bool should_flip(std::int32_t h) const {
    const std::int32_t g = w_.opposite(h);
    if (g < 0 || !part_[at(h / 3)] || !part_[at(g / 3)]) return false;
    const Vec3 a = w_.at(w_.from(h)), b = w_.at(w_.to(h)), c = w_.at(w_.apex(h)), d = w_.at(w_.apex(g));
    const Vec3 n = area(h / 3), m = area(g / 3);
    if (!(dot(a - c, b - c) / norm(n) + dot(a - d, b - d) / norm(m) < -kDelaunayGain)) return false;
    const double least = kFlatOff * dot(c - d, c - d);
    if (!(dot(cross(d - a, c - a), n) > least * norm(n) && dot(cross(b - d, c - d), n) > least * norm(n))) return false;
    return is_flat(h) && find_half_edge(w_, w_.apex(h), w_.apex(g)) < 0;
  }

  SplitSurface& s_;
  WalledSurface& w_;
  double limit_;
  std::vector<std::uint8_t> part_;      ///< |F|: 1: of a flat part
  std::vector<std::int32_t> doubtful_;  ///< edges that may not be Delaunay
  std::priority_queue<Long> long_;      ///< some outdated
};

}  // namespace

bool even_flat_parts(SplitSurface& s, const FlatPartLimits& limits) {
  FlatParts parts(s, limits.edge);
  if (!parts.find(limits.spoke)) return false;
  parts.make_delaunay();
  parts.halve(limits.most_faces);
  make_own_parents(s);
  s.flat = parts.take_marks();
  return true;
}

void even_bound_points(SplitSurface& s) {
  if (s.flat.empty()) return;
  FlatParts parts(s, HUGE_VAL);
  parts.mark_children();
  parts.make_delaunay();
}

}  // namespace kerf
