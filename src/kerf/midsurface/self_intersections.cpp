#include "kerf/midsurface/self_intersections.h"

#include <algorithm>

#include "kerf/base/parallel.h"
#include "kerf/spatial/bvh.h"
#include "kerf/spatial/predicates.h"

namespace kerf {
namespace {

constexpr std::size_t kCrossingGrain = 2048, kPlaces = 12;

/// Does segment p q, whose ends lie strictly on both sides of t's plane, meet t? At t's edges and corners too: the two sides of an even
/// grid that is folded over itself meet in nothing else.
bool pierces(Vec3 p, Vec3 q, const std::array<Vec3, 3>& t) {
  const int side = orient3d(t[0], t[1], t[2], p);
  if (side == 0 || orient3d(t[0], t[1], t[2], q) != -side) return false;
  const int a = orient3d(p, q, t[0], t[1]), b = orient3d(p, q, t[1], t[2]), c = orient3d(p, q, t[2], t[0]);
  const int least = std::min({a, b, c}), most = std::max({a, b, c});
  return least * most >= 0 && (least != 0 || most != 0);
}

bool intersect(const std::array<Vec3, 3>& s, const std::array<Vec3, 3>& t) {
  for (std::size_t k = 0; k < 3; ++k)
    if (pierces(s[k], s[(k + 1) % 3], t) || pierces(t[k], t[(k + 1) % 3], s)) return true;
  return false;
}

}  // namespace

SelfIntersections find_self_intersections(const TriangleMesh& mesh) {
  const TriangleView view(mesh);
  const TriangleBvh bvh(view);
  const std::size_t n = view.size(), chunks = (n + kCrossingGrain - 1) / kCrossingGrain;
  std::vector<std::size_t> pairs(chunks, 0);
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
        if (g <= f) return;
        for (std::size_t a = 0; a < 3; ++a)
          for (std::size_t b = 0; b < 3; ++b)
            if (view.corners[3 * i + a] == view.corners[3 * static_cast<std::size_t>(g) + b]) return;
        if (!intersect(s, view[g])) return;
        ++pairs[chunk];
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
    for (const Vec3 p : places[c])
      if (out.places.size() < kPlaces) out.places.push_back(p);
    out.triangles.insert(out.triangles.end(), triangles[c].begin(), triangles[c].end());
  }
  std::sort(out.triangles.begin(), out.triangles.end());
  out.triangles.erase(std::unique(out.triangles.begin(), out.triangles.end()), out.triangles.end());
  return out;
}

}  // namespace kerf
