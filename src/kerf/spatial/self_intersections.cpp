#include "kerf/spatial/self_intersections.h"

#include <algorithm>
#include <cmath>

#include "kerf/base/parallel.h"
#include "kerf/spatial/bvh.h"
#include "kerf/spatial/predicates.h"

namespace kerf {
namespace {

constexpr std::size_t kPlaces = 12;
constexpr std::size_t kCrossingGrain = 64,
                      kBlock = 8 * kCrossingGrain;  // triangles: limits are looked at between blocks

/// On which side of t's plane each corner of s lies.
struct Sides {
  std::array<int, 3> of;
  Sides(const std::array<Vec3, 3>& s, const std::array<Vec3, 3>& t) {
    for (std::size_t k = 0; k < 3; ++k) of[k] = orient3d(t[0], t[1], t[2], s[k]);
  }
  [[nodiscard]] bool in_plane() const { return of[0] == 0 && of[1] == 0 && of[2] == 0; }
  [[nodiscard]] bool on_one_side() const { return of[0] != 0 && of[0] == of[1] && of[1] == of[2]; }
};

/// Does line p q go through t, at its edges and corners too? The two sides of an even grid that is folded over itself meet in nothing else.
bool meets(Vec3 p, Vec3 q, const std::array<Vec3, 3>& t) {
  const int a = orient3d(p, q, t[0], t[1]), b = orient3d(p, q, t[1], t[2]), c = orient3d(p, q, t[2], t[0]);
  const int least = std::min({a, b, c}), most = std::max({a, b, c});
  return least * most >= 0 && (least != 0 || most != 0);
}

bool pierces(const std::array<Vec3, 3>& s, const Sides& sides, const std::array<Vec3, 3>& t) {
  for (std::size_t k = 0; k < 3; ++k)
    if (sides.of[k] * sides.of[(k + 1) % 3] < 0 && meets(s[k], s[(k + 1) % 3], t)) return true;
  return false;
}

/// Do all corners of s lie on one side of t's plane, and no doubt about it?
bool surely_beside(const std::array<Vec3, 3>& s, const std::array<Vec3, 3>& t) {
  const int side = surely_orient3d(t[0], t[1], t[2], s[0]);
  return side != 0 && surely_orient3d(t[0], t[1], t[2], s[1]) == side &&
         surely_orient3d(t[0], t[1], t[2], s[2]) == side;
}

bool intersect(const std::array<Vec3, 3>& s, const std::array<Vec3, 3>& t) {
  // On flat parts the one's corners often lie in the other's plane, and whole numbers are slow to say so.
  if (surely_beside(s, t) || surely_beside(t, s)) return false;
  const Sides of_s(s, t);
  return !of_s.in_plane() && !of_s.on_one_side() && (pierces(s, of_s, t) || pierces(t, Sides(t, s), s));
}

Vec3 normal_of(const std::array<Vec3, 3>& t) { return normalized(cross(t[1] - t[0], t[2] - t[0])); }

/// What s has in common with the plane through `at` with this normal, along that plane; and how far s reaches past it, where it reaches less.
struct Section {
  double from = HUGE_VAL, to = -HUGE_VAL, reach = 0;
  Section(const std::array<Vec3, 3>& s, Vec3 at, Vec3 normal, Vec3 along) {
    std::array<double, 3> height;
    for (std::size_t k = 0; k < 3; ++k) height[k] = dot(normal, s[k] - at);
    reach = std::max(
        0.0, std::min(std::max({height[0], height[1], height[2]}), -std::min({height[0], height[1], height[2]})));
    const auto add = [&](Vec3 p) {
      const double x = dot(along, p - at);
      from = std::min(from, x), to = std::max(to, x);
    };
    for (std::size_t k = 0; k < 3; ++k) {
      const double h = height[k], g = height[(k + 1) % 3];
      if (h == 0) add(s[k]);
      if (h * g < 0) add(lerp(s[k], s[(k + 1) % 3], h / (h - g)));
    }
  }
};

/// Metres: no more than the reach of either past the other's plane, and no more than the line along which they meet is long.
double depth_of(const std::array<Vec3, 3>& s, const std::array<Vec3, 3>& t) {
  const Vec3 of_s = normal_of(s), of_t = normal_of(t), along = normalized(cross(of_s, of_t));
  const Section in_t(s, t[0], of_t, along), in_s(t, s[0], of_s, along);
  const double shift = dot(along, s[0] - t[0]);
  const double length = std::min(in_t.to, in_s.to + shift) - std::max(in_t.from, in_s.from + shift);
  return std::max(0.0, std::min({in_t.reach, in_s.reach, length}));
}

bool share_a_corner(const TriangleView& view, std::int32_t f, std::int32_t g) {
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = 0; b < 3; ++b)
      if (view.corners[3 * static_cast<std::size_t>(f) + a] == view.corners[3 * static_cast<std::size_t>(g) + b])
        return true;
  return false;
}

Box3 box_of(const std::array<Vec3, 3>& t) {
  Box3 box;
  for (const Vec3 p : t) box.add(p);
  return box;
}

Vec3 middle_of(const std::array<Vec3, 3>& t) { return (1.0 / 3) * (t[0] + t[1] + t[2]); }

void sort_once(std::vector<std::int32_t>& ids) {
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
}

/// What a run of triangles has in common with those after each. It ends where it has made so many tests.
struct Run {
  SelfIntersections found;
  std::size_t tests = 0;
  void search(const TriangleView& view, const TriangleBvh& bvh, Neighbours neighbours, std::size_t begin,
              std::size_t end, std::size_t most_tests) {
    for (std::size_t i = begin; i < end && found.complete; ++i) {
      const auto f = static_cast<std::int32_t>(i);
      const std::array<Vec3, 3> s = view[f];
      bool any = false;
      bvh.for_each_in_box(view, box_of(s), [&](std::int32_t g) {
        if (g <= f) return;
        if (tests >= most_tests) found.complete = false;
        if (!found.complete) return;
        ++tests;
        if (neighbours == Neighbours::kLeaveOut && share_a_corner(view, f, g)) return;
        const std::array<Vec3, 3> t = view[g];
        if (!intersect(s, t)) return;
        ++found.pairs;
        if (const double depth = depth_of(s, t); depth > found.deepest) {
          found.deepest = depth;
          found.deepest_pair = {f, g};
        }
        any = true;
        found.triangles.push_back(g);
      });
      if (!any) continue;
      found.triangles.push_back(f);
      if (found.places.size() < kPlaces) found.places.push_back(middle_of(s));
    }
  }
};

void add(const SelfIntersections& more, SelfIntersections& out) {
  out.pairs += more.pairs;
  if (more.deepest > out.deepest) {
    out.deepest = more.deepest;
    out.deepest_pair = more.deepest_pair;
  }
  for (const Vec3 p : more.places)
    if (out.places.size() < kPlaces) out.places.push_back(p);
  out.triangles.insert(out.triangles.end(), more.triangles.begin(), more.triangles.end());
  out.complete = out.complete && more.complete;
}

}  // namespace

Result<SelfIntersections> find_self_intersections(const TriangleMesh& mesh, const SearchLimits& limits,
                                                  Neighbours neighbours) {
  const TriangleView view(mesh);
  const TriangleBvh bvh(view);
  const std::size_t n = view.size();
  SelfIntersections out;
  std::size_t tests = 0;
  for (std::size_t from = 0; from < n && out.complete; from += kBlock) {
    KERF_TRY(limits.progress("self-intersections", static_cast<double>(from) / static_cast<double>(n)));
    const std::size_t to = std::min(n, from + kBlock), left = limits.tests - tests;  // more than none
    std::array<Run, kBlock / kCrossingGrain> runs;
    parallel_for(to - from, kCrossingGrain, [&](std::size_t begin, std::size_t end) {
      runs[begin / kCrossingGrain].search(view, bvh, neighbours, from + begin, from + end, left);
    });
    for (const Run& run : runs) {
      add(run.found, out);
      tests += run.tests;
    }
    if (tests >= limits.tests || out.pairs >= limits.pairs) out.complete = out.complete && to == n;
  }
  sort_once(out.triangles);
  return out;
}

SelfIntersections find_self_intersections(const TriangleMesh& mesh, Neighbours neighbours) {
  return *find_self_intersections(mesh, SearchLimits{}, neighbours);  // nobody asks it to stop
}

Result<CrossingsSample> sample_crossings(const TriangleMesh& mesh, std::size_t count, const SearchLimits& limits) {
  const TriangleView view(mesh);
  const TriangleBvh bvh(view, count);
  CrossingsSample out;
  std::size_t tests = 0;
  const auto over = [&] { return out.crossings >= limits.pairs || tests >= limits.tests; };
  const std::size_t n = view.size();
  count = std::min(count, n);
  for (std::size_t i = 0; i < count && !over(); ++i) {
    KERF_TRY(limits.progress("self-intersections", static_cast<double>(i) / static_cast<double>(count)));
    const auto f = static_cast<std::int32_t>(i * n / count);
    const std::array<Vec3, 3> s = view[f];
    const std::size_t before = out.crossings;
    bvh.for_each_in_box(view, box_of(s), [&](std::int32_t g) {
      if (g == f || over()) return;
      ++tests;
      if (share_a_corner(view, f, g) || !intersect(s, view[g])) return;
      ++out.crossings;
      out.triangles.push_back(g);
    });
    if (out.crossings == before) continue;
    out.triangles.push_back(f);
    if (out.places.size() < kPlaces) out.places.push_back(middle_of(s));
  }
  sort_once(out.triangles);
  return out;
}

}  // namespace kerf
