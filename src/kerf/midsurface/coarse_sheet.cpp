#include "kerf/midsurface/coarse_sheet.h"

#include <algorithm>
#include <cmath>

#include "kerf/midsurface/remesh.h"
#include "kerf/midsurface/tolerances.h"
#include "kerf/spatial/self_intersections.h"

namespace kerf {
namespace {

using namespace mid;

constexpr int kMostRounds = 40;  // of averaging

/// Normals averaged over about half a thickness: what is rougher than that is no bend.
Column<Vec3> smooth_normals(const SurfaceMesh& m, double thickness) {
  Column<Vec3> normal = vertex_normals(m);
  // Averages of neighbours spread as far as the root of their number.
  const double steps = 0.5 * thickness / mean_edge(m);
  const int rounds = static_cast<int>(std::min<double>(kMostRounds, std::ceil(steps * steps)));
  Column<Vec3> next(normal.size());
  for (int i = 0; i < rounds; ++i) {
    for (std::int32_t v = 0; v < m.vertex_count(); ++v) {
      Vec3 sum = normal[v];
      m.for_each_neighbour(v, [&](std::int32_t u) { sum += normal[u]; });
      next[v] = normalized(sum);
    }
    std::swap(normal, next);
  }
  return normal;
}

}  // namespace

bool is_too_fine(std::size_t triangles) { return static_cast<double>(triangles) > kMostByNeed; }

Result<TriangleMesh> make_coarse_sheet(const TriangleMesh& surface, double thickness,
                                       const MidsurfaceOptions& options) {
  KERF_TRY(options.progress("sheet: prepare", 0));
  auto connected = connect(surface);
  if (!connected) return connected.error();
  if (topology(*connected).loops == 0)
    return bad_input("a closed surface is no sheet; its collision mesh is its mid-surface");
  MidSheet sheet;
  SurfaceMesh fine = compacted(*connected);
  Box3 box;
  for (const Vec3 p : fine.position) box.add(p);
  for (Vec3& p : fine.position) p = p - box.center();
  const Progress ask(
      [&](std::string_view, double fraction) { return options.progress("sheet: prepare", fraction).ok(); });
  auto working = make_working_mesh(std::move(fine), thickness, ask);
  if (!working) return working.error();
  sheet.mesh = std::move(working->mesh);
  sheet.normal = smooth_normals(sheet.mesh, thickness);
  sheet.half_thickness.assign(sheet.mesh.position.size(), 0.5 * thickness);
  sheet.from_border = distance_from_border(sheet.mesh);
  sheet.trusted.assign(sheet.mesh.position.size(), 1);

  const SheetSampler sampler(sheet);
  Column<double> limit = border_limits(sheet);
  double target = static_cast<double>(options.triangles);
  if (options.triangles == 0)
    target = std::clamp(sheet_sizes(sheet, kDefaultTriangles, limit).need, kDefaultTriangles, kMostByNeed);
  follow_hollows(sheet, options.triangles == 0, target, limit);
  TriangleMesh best;
  std::size_t fewest = 0;
  for (int i = 0; i < kTries; ++i, target *= kMore) {
    KERF_TRY(options.progress("sheet: triangles", static_cast<double>(i) / kTries));
    TriangleMesh made = to_triangle_mesh(remesh(sampler, sheet_sizes(sheet, target, limit), target).mesh);
    const std::size_t crossings = find_self_intersections(made).pairs;
    if (i == 0 || crossings < fewest) {
      best = std::move(made);
      fewest = crossings;
    }
    if (fewest == 0) break;
  }
  for (Vec3& p : best.positions) p += box.center();
  return best;
}

}  // namespace kerf
