#include "kerf/midsurface/border_tips.h"

#include <algorithm>
#include <cmath>

#include "kerf/midsurface/tolerances.h"

namespace kerf::mid {
namespace {

/// A corner that sticks out, and what is farthest out near it.
struct Tip {
  std::int32_t vertex = -1;
  Vec3 out, side;
  double reach = 0;            // metres
  double far = 0;              // metres out, of the farthest
  double first = 0, last = 0;  // of those as far out: there may be one above and one below
  [[nodiscard]] double middle() const { return 0.5 * (first + last); }
};

std::vector<Tip> find_tips(const CoarseMesh& c) {
  const SurfaceMesh& m = c.mesh;
  std::vector<Tip> tips;
  for (std::int32_t v = 0; v < m.vertex_count(); ++v) {
    if (!c.fixed[v] || c.curve[v] < 0) continue;
    std::int32_t before = -1;
    double shortest = HUGE_VAL;
    m.for_each_outgoing(v, [&](std::int32_t e) {
      if (m.twin[SurfaceMesh::prev(e)] < 0) before = m.apex(e);
      shortest = std::min(shortest, m.length(e));
    });
    const Vec3 x = m.position[v], n = c.normal[v], a = normalized(m.position[m.to(m.outgoing[v])] - x),
               b = normalized(m.position[before] - x);
    if (!(dot(cross(a, b), n) > 0)) continue;  // the material is outside of the corner
    Vec3 out = -1 * (a + b);
    out = out - dot(out, n) * n;
    if (!(norm(out) > 0)) continue;
    out = normalized(out);
    tips.push_back({v, out, cross(n, out), kTipReach * shortest});
  }
  return tips;
}

}  // namespace

void reach_tips(CoarseMesh& c, const SurfaceMesh& surface, const TriangleBvh& bvh) {
  const TriangleView view = surface.view();
  std::vector<std::int32_t> near;
  for (Tip& t : find_tips(c)) {
    const Vec3 x = c.mesh.position[t.vertex];
    const ClosestPoint start = bvh.closest(view, x, t.reach);
    if (!start.valid()) continue;
    near.clear();
    const auto visit = [&](std::int32_t v) {
      if (norm(surface.position[v] - x) < t.reach && std::find(near.begin(), near.end(), v) == near.end())
        near.push_back(v);
    };
    for (std::int32_t k = 0; k < 3; ++k) visit(surface.origin[3 * start.triangle + k]);
    for (std::size_t i = 0; i < near.size(); ++i) {
      const Vec3 d = surface.position[near[i]] - x;
      const double far = dot(d, t.out), aside = dot(d, t.side), same = kTipSame * t.reach;
      if (far > t.far + same) t.first = t.last = aside;
      if (far > t.far - same) {
        t.far = std::max(t.far, far);
        t.first = std::min(t.first, aside), t.last = std::max(t.last, aside);
      }
      surface.for_each_neighbour(near[i], visit);
    }
    c.mesh.position[t.vertex] += t.far * t.out + t.middle() * t.side;
  }
}

}  // namespace kerf::mid
