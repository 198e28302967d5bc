#include "kerf/spatial/self_intersections.h"

#include <algorithm>
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

/// How far p reaches past t's plane, on the side where it reaches less.
double reach(const std::array<Vec3, 3>& p, const std::array<Vec3, 3>& t) {
  const Vec3 n = cross(t[1] - t[0], t[2] - t[0]);
  double above = 0, below = 0;
  for (const Vec3 x : p) {
    above = std::max(above, dot(n, x - t[0]));
    below = std::max(below, -dot(n, x - t[0]));
  }
  return std::min(above, below) / norm(n);
}

bool share_a_corner(const TriangleView& view, std::int32_t f, std::int32_t g) {
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = 0; b < 3; ++b)
      if (view.corners[3 * static_cast<std::size_t>(f) + a] == view.corners[3 * static_cast<std::size_t>(g) + b]) return true;
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
        if (const double depth = std::min(reach(s, t), reach(t, s)); depth > deepest[chunk].first) deepest[chunk] = {depth, {f, g}};
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
