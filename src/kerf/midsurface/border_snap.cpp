#include "kerf/midsurface/border_snap.h"

#include <algorithm>
#include <cmath>

#include "kerf/base/parallel.h"

namespace kerf::mid {
namespace {

constexpr std::size_t kSnapGrain = 8192;
constexpr double kSnapEdges = 0.5;  // of a border edge: how far a vertex may move

}  // namespace

void snap_border(CoarseMesh& c, const std::vector<Vec3>& positions, const TriangleMesh& surface) {
  SurfaceMesh& m = c.mesh;
  std::vector<Vec3> rim;
  std::vector<std::int32_t> rim_vertex;
  double reach = 0;
  for (std::int32_t v = 0; v < m.vertex_count(); ++v) {
    if (c.curve[v] < 0) continue;
    rim.push_back(m.position[v]);
    rim_vertex.push_back(v);
    reach = std::max({reach, c.half_thickness[v], kSnapEdges * m.length(m.outgoing[v])});
  }
  if (rim.empty()) return;
  // Points as flat triangles; of the surface only triangles with a corner near one of them, or large ones.
  std::vector<std::int32_t> corners;
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(rim.size()); ++i) corners.insert(corners.end(), {i, i, i});
  const TriangleView rim_view(rim, corners);
  const TriangleBvh rim_bvh(rim_view);
  std::vector<std::uint8_t> near(surface.triangles.size(), 0);
  parallel_for(near.size(), kSnapGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) {
      const auto& t = surface.triangles.raw()[f];
      const Vec3 p = positions[t[0].index()], q = positions[t[1].index()], r = positions[t[2].index()];
      const double size = std::max({norm(q - p), norm(r - q), norm(p - r)});
      near[f] = rim_bvh.closest(rim_view, p, reach + size).valid();
    }
  });
  std::vector<std::int32_t> candidates;
  for (std::size_t f = 0; f < near.size(); ++f)
    if (near[f])
      for (const VertexId v : surface.triangles.raw()[f]) candidates.push_back(v.value);
  if (candidates.empty()) return;
  const TriangleView view(positions, candidates);
  const TriangleBvh bvh(view);
  for (std::size_t i = 0; i < rim.size(); ++i) {
    const std::int32_t v = rim_vertex[i];
    const double limit = std::max(c.half_thickness[v], kSnapEdges * m.length(m.outgoing[v]));
    if (const ClosestPoint q = bvh.closest(view, rim[i], limit); q.valid()) m.position[v] = q.point;
  }
}

}  // namespace kerf::mid
