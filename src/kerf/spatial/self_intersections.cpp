#include "kerf/spatial/self_intersections.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "kerf/base/parallel.h"
#include "kerf/spatial/bvh.h"
#include "kerf/spatial/predicates.h"

namespace kerf {
namespace {

constexpr std::size_t kCrossingGrain = 2048, kPlaces = 12;

/// On which side of t's plane each corner of s lies.
struct Sides {
  std::array<int, 3> of;
  Sides(const std::array<Vec3, 3>& s, const std::array<Vec3, 3>& t) {
    for (std::size_t k = 0; k < 3; ++k) of[k] = orient3d(t[0], t[1], t[2], s[k]);
  }
  [[nodiscard]] bool in_plane() const { return of[0] == 0 && of[1] == 0 && of[2] == 0; }
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

bool intersect(const std::array<Vec3, 3>& s, const std::array<Vec3, 3>& t) {
  const Sides of_s(s, t);
  return !of_s.in_plane() && (pierces(s, of_s, t) || pierces(t, Sides(t, s), s));
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

}  // namespace

SelfIntersections find_self_intersections(const TriangleMesh& mesh, Neighbours neighbours) {
  const TriangleView view(mesh);
  const TriangleBvh bvh(view);
  const std::size_t n = view.size(), chunks = (n + kCrossingGrain - 1) / kCrossingGrain;
  std::vector<std::size_t> pairs(chunks, 0);
  std::vector<std::pair<double, std::array<std::int32_t, 2>>> deepest(chunks, {0, {-1, -1}});
  std::vector<std::vector<Vec3>> places(chunks);
  std::vector<std::vector<std::int32_t>> triangles(chunks);
  parallel_for(n, kCrossingGrain, [&](std::size_t begin, std::size_t end) {
    const std::size_t chunk = begin / kCrossingGrain;
    for (std::size_t i = begin; i < end; ++i) {
      const auto f = static_cast<std::int32_t>(i);
      const std::array<Vec3, 3> s = view[f];
      Box3 box;
      for (const Vec3 p : s) box.add(p);
      bool found = false;
      bvh.for_each_in_box(view, box, [&](std::int32_t g) {
        if (g <= f || (neighbours == Neighbours::kLeaveOut && share_a_corner(view, f, g))) return;
        const std::array<Vec3, 3> t = view[g];
        if (!intersect(s, t)) return;
        ++pairs[chunk];
        if (const double depth = depth_of(s, t); depth > deepest[chunk].first) deepest[chunk] = {depth, {f, g}};
        found = true;
        triangles[chunk].push_back(g);
      });
      if (found) triangles[chunk].push_back(f);
      if (found && places[chunk].size() < kPlaces) places[chunk].push_back((1.0 / 3) * (s[0] + s[1] + s[2]));
    }
  });
  SelfIntersections out;
  for (std::size_t c = 0; c < chunks; ++c) {
    out.pairs += pairs[c];
    if (deepest[c].first > out.deepest) std::tie(out.deepest, out.deepest_pair) = deepest[c];
    for (const Vec3 p : places[c])
      if (out.places.size() < kPlaces) out.places.push_back(p);
    out.triangles.insert(out.triangles.end(), triangles[c].begin(), triangles[c].end());
  }
  std::sort(out.triangles.begin(), out.triangles.end());
  out.triangles.erase(std::unique(out.triangles.begin(), out.triangles.end()), out.triangles.end());
  return out;
}

}  // namespace kerf
