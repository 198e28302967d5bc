#include "kerf/midsurface/midsurface.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "kerf/midsurface/border_snap.h"
#include "kerf/midsurface/quality.h"
#include "kerf/midsurface/relax.h"
#include "kerf/midsurface/self_intersections.h"
#include "kerf/midsurface/surface_filter.h"
#include "kerf/midsurface/verdict.h"

namespace kerf {
namespace {

using namespace mid;

constexpr double kDefaultTriangles = 160;
constexpr double kMostByNeed = 1500;     // triangles that the bends may ask for by themselves
constexpr double kMostSpanning = 0.1;    // of the inner edges may join two rim vertices
constexpr std::size_t kMostSearched = 300000;  // triangles of surfaces that are searched for self-intersections
constexpr std::uint8_t kCrossing = 2;    // flag of what passes through itself
constexpr int kTries = 4;
constexpr double kMore = 1.3;            // times as many triangles after a try that left something bad

class Stopwatch {
 public:
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double s = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    return s;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

MidsurfaceDiagnosis diagnosis(const SurfaceMesh& m, const Pairing& pairing, const SideLabels& labels,
                              std::vector<std::uint8_t> flag) {
  MidsurfaceDiagnosis out;
  out.surface = to_triangle_mesh(m);
  out.flag = std::move(flag);
  for (std::int32_t f = 0; f < m.face_count(); ++f) {
    const Pair& p = pairing.pair[f];
    out.side.push_back(static_cast<float>(field_at(m, labels.field, f)));
    out.confidence.push_back(static_cast<float>(p.confidence));
    out.thickness.push_back(static_cast<float>(p.face < 0 ? 0 : p.distance));
  }
  return out;
}

struct Try {
  CoarseMesh mesh;
  RelaxReport relaxed;
  MidsurfaceQuality quality;
  std::size_t crossings = 0;  ///< pairs of triangles that pass through each other
  [[nodiscard]] bool good() const { return bad() == 0 && quality.spanning_edges <= kMostSpanning; }
  [[nodiscard]] std::size_t bad() const { return relaxed.blind.size() + crossings; }
};

}  // namespace

Result<Midsurface> make_midsurface(const TriangleMesh& surface, const MidsurfaceOptions& options) {
  Midsurface out;
  Stopwatch watch, total;
  const auto tell = [&](std::string_view stage) { return options.progress(stage, 0); };
  KERF_TRY(tell("mid-surface: prepare"));
  auto connected = connect(surface);
  if (!connected) return connected.error();
  SurfaceMesh filtered = std::move(*connected);
  for (const std::int32_t t : filtered.twin)
    if (t < 0) return bad_input("only closed surfaces have a mid-surface; close the holes, or give a collision mesh");
  // Work around the origin: positions far away would lose digits in products.
  Box3 box;
  for (const Vec3 p : filtered.position) box.add(p);
  const Vec3 centre = box.center();
  for (Vec3& p : filtered.position) p = p - centre;
  const std::vector<Vec3> visual = filtered.position;
  const FilterReport filter = filter_surface(filtered);
  if (filter.spikes > 0)
    out.notes.push_back(fmt::format("{} spikes were left out of account, the first at ({:.4g}, {:.4g}, {:.4g})",
                                    filter.spikes, filter.spike_places[0].x + centre.x,
                                    filter.spike_places[0].y + centre.y, filter.spike_places[0].z + centre.z));
  if (filter.smoothing_steps > 0)
    out.notes.push_back(fmt::format("the surface is rough (neighbouring triangles turn by {:.0f} degrees); a copy smoothed {} "
                                    "times was used to find the middle",
                                    filter.roughness * 57.29577951308232, filter.smoothing_steps));
  SelfIntersections own;
  if (surface.triangles.size() <= kMostSearched) {
    own = find_self_intersections(surface);
    if (own.pairs > 0)
      out.notes.push_back(fmt::format("the surface passes through itself at {} pairs of triangles, the first near ({:.4g}, {:.4g}, "
                                      "{:.4g}): repair it there, what lies twice is counted twice",
                                      own.pairs, own.places[0].x, own.places[0].y, own.places[0].z));
    for (const Vec3 p : own.places) out.verdict.places.push_back({p, "the surface passes through itself"});
  }
  out.seconds.prepare = watch.lap();

  KERF_TRY(tell("mid-surface: divide"));
  const WorkingMesh work = make_working_mesh(std::move(filtered));
  const TriangleBvh bvh(work.mesh.view());
  out.seconds.working = watch.lap();

  KERF_TRY(tell("mid-surface: pairs"));
  const Pairing pairing = find_pairs(work.mesh, bvh, work.thickness);
  out.seconds.pairs = watch.lap();

  KERF_TRY(tell("mid-surface: sides"));
  const SideLabels labels = label_sides(work.mesh, pairing, work.thickness);
  auto plus = cut_side(work.mesh, labels.field, 1), minus = cut_side(work.mesh, labels.field, -1);
  if (!plus) return plus.error();
  if (!minus) return minus.error();
  std::vector<std::uint8_t> flag;
  const bool two_sides = judge_sides({work, pairing, labels, plus->mesh, minus->mesh, centre}, out.verdict, flag);
  for (const std::int32_t t : own.triangles) {
    const auto& corners = surface.triangles.raw()[static_cast<std::size_t>(t)];
    const Vec3 middle = (1.0 / 3) * (surface.positions[corners[0]] + surface.positions[corners[1]] + surface.positions[corners[2]]);
    if (const auto near = bvh.closest(work.mesh.view(), middle - centre); near.valid()) flag[static_cast<std::size_t>(near.triangle)] = kCrossing;
  }
  out.diagnosis = diagnosis(work.mesh, pairing, labels, std::move(flag));
  for (Vec3& p : out.diagnosis.surface.positions) p += centre;
  out.seconds.labels = watch.lap();
  if (!two_sides || out.verdict.thinness == Thinness::kNotThin) {
    out.seconds.total = total.lap();
    return out;
  }

  KERF_TRY(tell("mid-surface: sheet"));
  const MidSheet sheet = make_mid_sheet(std::move(*plus), {work, bvh, pairing, labels});
  judge_sheet(sheet, work, centre, out.verdict);
  out.seconds.sheet = watch.lap();
  if (out.verdict.thinness == Thinness::kNotThin) {
    out.seconds.total = total.lap();
    return out;
  }

  const SheetSampler sampler(sheet);
  const TwoSidedRays rays(work.mesh, bvh, labels.field, pairing.normal);
  const auto attempt = [&](double target) -> Result<Try> {
    Try t;
    const SheetSizes sizes = sheet_sizes(sheet, target);
    KERF_TRY(tell("mid-surface: triangles"));
    t.mesh = remesh(sampler, sizes, target);
    out.seconds.remesh += watch.lap();
    KERF_TRY(tell("mid-surface: middle"));
    t.relaxed = relax_to_middle(t.mesh, sampler, sizes, rays);
    out.seconds.relax += watch.lap();
    if (work.coarsened || filter.spikes > 0 || filter.smoothing_steps > 0) snap_border(t.mesh, visual, surface);
    t.crossings = find_self_intersections(to_triangle_mesh(t.mesh.mesh)).pairs;
    KERF_TRY(tell("mid-surface: quality"));
    t.quality = measure_quality(t.mesh, {work.mesh, bvh, labels, visual});
    t.quality.need = sizes.need;
    out.seconds.quality += watch.lap();
    return t;
  };
  double target = static_cast<double>(options.triangles);
  if (options.triangles == 0)
    target = std::clamp(sheet_sizes(sheet, kDefaultTriangles).need, kDefaultTriangles, kMostByNeed);
  auto first = attempt(target);
  if (!first) return first.error();
  Try best = std::move(first).value();
  for (int i = 1; i < kTries && !best.good(); ++i) {
    target *= kMore;
    auto next = attempt(target);
    if (!next) return next.error();
    if (next->bad() <= best.bad()) best = std::move(next).value();
  }
  if (best.crossings > 0)
    out.verdict.warnings.push_back(fmt::format("the collision mesh passes through itself at {} pairs of triangles: take more of them",
                                               best.crossings));
  if (!best.relaxed.blind.empty())
    out.verdict.warnings.push_back(fmt::format("{} vertices of the collision mesh do not see both sides of the body", best.relaxed.blind.size()));
  if (best.quality.spanning_edges > kMostSpanning)
    out.verdict.warnings.push_back("parts of the body are narrower than a triangle of the collision mesh: ask for more of them");
  if (!best.good()) out.verdict.thinness = std::max(out.verdict.thinness, Thinness::kDoubtful);
  out.quality = best.quality;
  std::int32_t inner = 0;
  for (const std::int32_t c : best.mesh.curve) inner += c < 0;
  out.quality.good_rays = inner > 0 ? 1 - static_cast<double>(best.relaxed.blind.size()) / inner : 1;
  for (Vec3& p : best.mesh.mesh.position) p += centre;
  out.collision = to_triangle_mesh(best.mesh.mesh);
  out.half_thickness = best.mesh.half_thickness;
  out.seconds.total = total.lap();
  return out;
}

}  // namespace kerf
