#include "kerf/midsurface/midsurface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kerf/base/degrees.h"
#include "kerf/base/stopwatch.h"
#include "kerf/midsurface/border_snap.h"
#include "kerf/midsurface/border_tips.h"
#include "kerf/midsurface/quality.h"
#include "kerf/midsurface/relax.h"
#include "kerf/midsurface/surface_filter.h"
#include "kerf/midsurface/tolerances.h"
#include "kerf/midsurface/verdict.h"
#include "kerf/spatial/self_intersections.h"

namespace kerf {
namespace {

using namespace mid;

constexpr double kMostSpanning = 0.1;          // of the inner edges may join two rim vertices
constexpr std::size_t kMostSearched = 300000;  // triangles of surfaces that are searched for self-intersections
constexpr std::uint8_t kCrossing = 2,
                       kBadMesh = 3;  // flags: what passes through itself; where the collision mesh is bad
constexpr std::size_t kMostMarked = 12;
constexpr double kOfWidth = 0.55,
                 kSmaller = 0.6;  // sizes in the next try: of the width of a narrow place, of the size around a bad one
constexpr double kNearMiddle = 0.3;  // of a spanning edge
constexpr double kHopeless = 0.25;   // bad places a vertex: more triangles mend none of them

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
  std::size_t crossings = 0;           ///< pairs of triangles that pass through each other
  std::vector<std::int32_t> crossing;  ///< those triangles
  [[nodiscard]] bool good() const { return bad() == 0 && quality.spanning_edges <= kMostSpanning; }
  [[nodiscard]] double badness() const {
    return static_cast<double>(bad()) / mesh.mesh.face_count() +
           (quality.spanning_edges > kMostSpanning ? quality.spanning_edges : 0);
  }
  [[nodiscard]] std::size_t bad() const { return relaxed.blind.size() + crossings; }
};

/// Smaller sizes around what a try has left bad: where the sheet is narrower than a triangle, an inner vertex must fit in.
void refine_bad_places(const Try& t, const MidSheet& sheet, Column<double>& limit) {
  const auto refine = [&](Vec3 p, double reach, double size) {
    for (std::int32_t v = 0; v < sheet.mesh.vertex_count(); ++v)
      if (norm(sheet.mesh.position[v] - p) < reach) limit[v] = std::min(limit[v], size);
  };
  const SurfaceMesh& m = t.mesh.mesh;
  if (t.quality.spanning_edges > kMostSpanning)
    for (std::int32_t h = 0; h < m.origin.count(); ++h) {
      if (!m.is_edge(h) || m.twin[h] < 0 || t.mesh.curve[m.from(h)] < 0 || t.mesh.curve[m.to(h)] < 0) continue;
      const double length = m.length(h);
      const Vec3 middle = 0.5 * (m.position[m.from(h)] + m.position[m.to(h)]);
      double half_width = 0;
      for (std::int32_t v = 0; v < sheet.mesh.vertex_count(); ++v)
        if (norm(sheet.mesh.position[v] - middle) < kNearMiddle * length)
          half_width = std::max(half_width, sheet.from_border[v]);
      if (half_width > 0) refine(middle, 0.75 * length, kOfWidth * 2 * half_width);
    }
  for (const std::int32_t v : t.relaxed.blind) refine(m.position[v], 2 * t.mesh.size[v], kSmaller * t.mesh.size[v]);
  for (const std::int32_t f : t.crossing) {
    const std::int32_t v = m.origin[3 * f];
    refine(m.centroid(f), 2 * t.mesh.size[v], kSmaller * t.mesh.size[v]);
  }
}

/// The first bad places of the try that was taken, whose positions are the person's again.
void mark_what_is_bad(const Try& t, Midsurface& out) {
  const SurfaceMesh& m = t.mesh.mesh;
  const std::size_t crossing = std::min(t.crossing.size(), kMostMarked),
                    blind = std::min(t.relaxed.blind.size(), kMostMarked);
  for (std::size_t i = 0; i < crossing; ++i)
    mark_bad_place(out, m.centroid(t.crossing[i]), t.mesh.size[m.origin[3 * t.crossing[i]]],
                   "the collision mesh passes through itself");
  for (std::size_t i = 0; i < blind; ++i)
    mark_bad_place(out, m.position[t.relaxed.blind[i]], t.mesh.size[t.relaxed.blind[i]],
                   "a collision vertex does not see both sides");
}

std::string text(Vec3 p) { return fmt::format("({:.4g}, {:.4g}, {:.4g})", p.x, p.y, p.z); }

/// What is known of a surface whose sides are not looked for: which triangles cross others.
void diagnose_crossings(const TriangleMesh& surface, const std::vector<std::int32_t>& crossing,
                        MidsurfaceDiagnosis& d) {
  d.surface.positions = surface.positions;
  d.surface.triangles = surface.triangles;
  const std::size_t n = surface.triangles.size();
  d.side.assign(n, 0);
  d.confidence.assign(n, 0);
  d.thickness.assign(n, 0);
  d.flag.assign(n, 0);
  for (const std::int32_t t : crossing) d.flag[static_cast<std::size_t>(t)] = kCrossing;
}

/// A scrambled surface has neither sides nor distances, and every box of triangles touches every other.
void refuse_scrambled(const TriangleMesh& surface, const CrossingsSample& sample, Midsurface& out) {
  MidsurfaceVerdict& v = out.verdict;
  v.thinness = Thinness::kNotThin;
  v.reasons.push_back(fmt::format(
      "the surface passes through itself all over, first near {}: its triangles cross {} others and more on the "
      "mean; repair it, or export it again",
      text(sample.places[0]), kAllOver));
  for (const Vec3 p : sample.places) v.places.push_back({p, "the surface passes through itself"});
  diagnose_crossings(surface, sample.triangles, out.diagnosis);
}

/// Of one that is rough all over, so that nothing of it can be left out, sides are not looked for. The last note tells where it crosses itself.
void refuse_crossing(const TriangleMesh& surface, const SelfIntersections& own, Midsurface& out) {
  out.verdict.thinness = Thinness::kNotThin;
  out.verdict.reasons.push_back(out.notes.back());
  out.notes.pop_back();
  diagnose_crossings(surface, own.triangles, out.diagnosis);
}

}  // namespace

void mark_bad_place(Midsurface& made, Vec3 point, double reach, const std::string& what) {
  made.verdict.places.push_back({point, what});
  MidsurfaceDiagnosis& d = made.diagnosis;
  for (std::size_t f = 0; f < d.flag.size(); ++f) {
    const auto& t = d.surface.triangles.raw()[f];
    const Vec3 middle = (1.0 / 3) * (d.surface.positions[t[0]] + d.surface.positions[t[1]] + d.surface.positions[t[2]]);
    if (norm(middle - point) < reach) d.flag[f] = kBadMesh;
  }
}

struct PreparedMidsurface::Parts {
  explicit Parts(const TriangleMesh& whole) : surface(whole) {}

  const TriangleMesh& surface;
  Vec3 centre;  ///< in the person's frame; all meshes here lie around the origin
  std::vector<Vec3> visual;
  FilterReport filter;
  WorkingMesh work;
  TriangleBvh bvh;
  Pairing pairing;
  SideLabels labels;
  MidSheet sheet;
  Midsurface found;  ///< what is known without a collision mesh: all of it where the body is not thin
};

PreparedMidsurface::PreparedMidsurface(std::unique_ptr<const Parts> parts) : parts_(std::move(parts)) {}
PreparedMidsurface::PreparedMidsurface(PreparedMidsurface&&) noexcept = default;
PreparedMidsurface& PreparedMidsurface::operator=(PreparedMidsurface&&) noexcept = default;
PreparedMidsurface::~PreparedMidsurface() = default;

Result<PreparedMidsurface> prepare_midsurface(const TriangleMesh& surface, const Progress& progress) {
  auto parts = std::make_unique<PreparedMidsurface::Parts>(surface);
  PreparedMidsurface::Parts& p = *parts;
  Midsurface& out = p.found;
  Stopwatch watch, total;
  const auto tell = [&](std::string_view stage) { return progress(stage, 0); };
  const auto prepared = [&] {
    out.seconds.total = total.lap();
    return PreparedMidsurface(std::move(parts));
  };
  KERF_TRY(tell("mid-surface: prepare"));
  auto connected = connect(surface);
  if (!connected) return connected.error();
  SurfaceMesh filtered = std::move(*connected);
  for (const std::int32_t t : filtered.twin)
    if (t < 0) return bad_input("only closed surfaces have a mid-surface; close the holes, or give a collision mesh");
  const Progress ask(
      [&](std::string_view, double fraction) { return progress("mid-surface: prepare", fraction).ok(); });
  const std::size_t enough = kAllOver * std::min(kCrossingSample, surface.triangles.size());
  const auto sample = sample_crossings(surface, kCrossingSample, {enough, kMostCrossingTests, ask});
  if (!sample) return sample.error();
  if (sample->crossings >= enough) {
    refuse_scrambled(surface, *sample, out);
    out.seconds.prepare = watch.lap();
    return prepared();
  }
  SelfIntersections own;
  if (surface.triangles.size() <= kMostSearched) {
    auto found = find_self_intersections(surface, {kMostCrossings, kMostCrossingTests, ask});
    if (!found) return found.error();
    own = std::move(*found);
  }
  out.own_crossings = own.pairs;
  // Work around the origin: positions far away would lose digits in products.
  Box3 box;
  for (const Vec3 at : filtered.position) box.add(at);
  p.centre = box.center();
  for (Vec3& at : filtered.position) at = at - p.centre;
  p.visual = filtered.position;
  auto filter_report = filter_surface(filtered, progress);
  if (!filter_report) return filter_report.error();
  p.filter = std::move(*filter_report);
  const FilterReport& filter = p.filter;
  const Vec3 centre = p.centre;
  if (filter.spikes > 0)
    out.notes.push_back(fmt::format("{} spikes were left out of account, the first at ({:.4g}, {:.4g}, {:.4g})",
                                    filter.spikes, filter.spike_places[0].x + centre.x,
                                    filter.spike_places[0].y + centre.y, filter.spike_places[0].z + centre.z));
  if (filter.smoothing_steps > 0)
    out.notes.push_back(fmt::format(
        "at {:.0f} % of the edges neighbouring triangles turn by more than 20 degrees, at half of all by more than {:.0f}, as on scans; a copy "
        "smoothed {} was used to find the middle",
        100 * filter.steps, filter.roughness * kDegrees,
        filter.smoothing_steps == 1 ? "once" : fmt::format("{} times", filter.smoothing_steps)));
  if (own.pairs > 0)
    out.notes.push_back(
        fmt::format("the surface passes through itself at {} pairs of triangles{}, the first near {}: repair it there, "
                    "what lies twice is counted twice",
                    own.pairs, own.complete ? "" : " and more", text(own.places[0])));
  for (const Vec3 at : own.places) out.verdict.places.push_back({at, "the surface passes through itself"});
  out.seconds.prepare = watch.lap();

  KERF_TRY(tell("mid-surface: divide"));
  auto working = coarse_working_mesh(std::move(filtered), 0, progress);
  if (!working) return working.error();
  p.work = std::move(*working);
  const auto hopeless = [&] { return p.work.rough && own.pairs > 0; };
  if (!hopeless()) KERF_TRY(divide_working_mesh(p.work, progress));
  if (hopeless()) {
    refuse_crossing(surface, own, out);
    out.seconds.working = watch.lap();
    return prepared();
  }
  const WorkingMesh& work = p.work;
  p.bvh = TriangleBvh(work.mesh.view());
  const TriangleBvh& bvh = p.bvh;
  out.seconds.working = watch.lap();

  KERF_TRY(tell("mid-surface: pairs"));
  Result<Pairing> pairs = find_pairs(work.mesh, bvh, work.thickness, progress);
  if (!pairs) return pairs.error();
  p.pairing = std::move(*pairs);
  const Pairing& pairing = p.pairing;
  out.seconds.pairs = watch.lap();

  KERF_TRY(tell("mid-surface: sides"));
  Result<SideLabels> labelled = label_sides(work.mesh, pairing, work.thickness, progress);
  if (!labelled) return labelled.error();
  p.labels = std::move(*labelled);
  const SideLabels& labels = p.labels;
  auto plus = cut_side(work.mesh, labels.field, 1), minus = cut_side(work.mesh, labels.field, -1);
  if (!plus) return plus.error();
  if (!minus) return minus.error();
  std::vector<std::uint8_t> flag;
  const bool two_sides = judge_sides({work, pairing, labels, plus->mesh, minus->mesh, centre}, out.verdict, flag);
  for (const std::int32_t t : own.triangles) {
    const auto& corners = surface.triangles.raw()[static_cast<std::size_t>(t)];
    const Vec3 middle =
        (1.0 / 3) * (surface.positions[corners[0]] + surface.positions[corners[1]] + surface.positions[corners[2]]);
    if (const auto near = bvh.closest(work.mesh.view(), middle - centre); near.valid())
      flag[static_cast<std::size_t>(near.triangle)] = kCrossing;
  }
  out.diagnosis = diagnosis(work.mesh, pairing, labels, std::move(flag));
  for (Vec3& at : out.diagnosis.surface.positions) at += centre;
  out.seconds.labels = watch.lap();
  // A surface that passes through itself is the cause of much else, so that comes first.
  const auto refuse = [&] {
    if (own.pairs > 0) {
      out.verdict.reasons.insert(out.verdict.reasons.begin(), out.notes.back());
      out.notes.pop_back();
    }
    return prepared();
  };
  if (!two_sides) return refuse();

  KERF_TRY(tell("mid-surface: sheet"));
  p.sheet = make_mid_sheet(std::move(*plus), {work, bvh, pairing, labels});
  const auto of_sides = static_cast<std::ptrdiff_t>(out.verdict.reasons.size());
  judge_sheet(p.sheet, work, bvh, centre, out.verdict);
  // How stout a body is says more than what its sides look like then: a rod is narrow everywhere, and branches where it ends.
  std::rotate(out.verdict.reasons.begin(), out.verdict.reasons.begin() + of_sides, out.verdict.reasons.end());
  if (is_stout(out.verdict)) out.verdict.reasons.resize(1);
  out.seconds.sheet = watch.lap();
  if (out.verdict.thinness == Thinness::kNotThin) return refuse();
  return prepared();
}

Result<Midsurface> make_midsurface(const PreparedMidsurface& prepared, const MidsurfaceOptions& options) {
  const PreparedMidsurface::Parts& p = prepared.parts();
  Midsurface out = p.found;
  if (out.verdict.thinness == Thinness::kNotThin) return out;
  Stopwatch watch, total;
  const SheetSampler sampler(p.sheet);
  const TwoSidedRays rays(p.work.mesh, p.bvh, p.labels.field, p.pairing.normal);
  Column<double> limit = border_limits(p.sheet);
  const auto attempt = [&](double target) -> Result<Try> {
    Try t;
    const SheetSizes sizes = sheet_sizes(p.sheet, target, limit);
    KERF_TRY(options.progress("mid-surface: triangles", 0));
    t.mesh = remesh(sampler, sizes, target);
    out.seconds.remesh += watch.lap();
    KERF_TRY(options.progress("mid-surface: middle", 0));
    t.relaxed = relax_to_middle(t.mesh, sampler, sizes, rays);
    out.seconds.relax += watch.lap();
    if (p.work.coarsened || p.filter.spikes > 0 || p.filter.smoothing_steps > 0)
      snap_border(t.mesh, p.visual, p.surface);
    if (p.filter.spikes == 0 && p.filter.smoothing_steps == 0) reach_tips(t.mesh, p.work.mesh, p.bvh);
    SelfIntersections through = find_self_intersections(to_triangle_mesh(t.mesh.mesh));
    t.crossings = through.pairs;
    t.crossing = std::move(through.triangles);
    KERF_TRY(options.progress("mid-surface: quality", 0));
    t.quality = measure_quality(t.mesh, {p.work.mesh, p.bvh, p.labels, p.visual});
    t.quality.need = sizes.need;
    out.seconds.quality += watch.lap();
    return t;
  };
  double target = static_cast<double>(options.triangles);
  if (options.triangles == 0)
    target = std::clamp(sheet_sizes(p.sheet, kDefaultTriangles, limit).need, kDefaultTriangles, kMostByNeed);
  follow_hollows(p.sheet, options.triangles == 0, target, limit);
  const double most = std::max(kMostByNeed, 2 * target);
  auto next = attempt(target);
  if (!next) return next.error();
  Try best = *next;
  // More triangles mend neither a surface that passes through itself nor a sheet that is bad all over.
  const bool hopeless =
      out.own_crossings > 0 || static_cast<double>(best.bad()) > kHopeless * best.mesh.mesh.vertex_count();
  for (int i = 1; i < kTries && !best.good() && !hopeless; ++i) {
    refine_bad_places(*next, p.sheet, limit);
    target = std::min(most, std::max(kMore * target, sheet_sizes(p.sheet, target, limit).need));
    next = attempt(target);
    if (!next) return next.error();
    if (next->badness() <= best.badness()) best = *next;
  }
  if (out.own_crossings > 0 && !best.good()) {
    out.verdict.warnings.push_back(out.notes.back());
    out.notes.pop_back();
  }
  if (best.crossings > 0)
    out.verdict.warnings.push_back(fmt::format(
        "the collision mesh passes through itself at {} pairs of triangles: take more of them", best.crossings));
  if (!best.relaxed.blind.empty())
    out.verdict.warnings.push_back(
        fmt::format("{} vertices of the collision mesh do not see both sides of the body", best.relaxed.blind.size()));
  if (best.quality.spanning_edges > kMostSpanning)
    out.verdict.warnings.push_back(
        "parts of the body are narrower than a triangle of the collision mesh: ask for more of them");
  if (!best.good()) out.verdict.thinness = std::max(out.verdict.thinness, Thinness::kDoubtful);
  out.quality = best.quality;
  out.quality.crossings = best.crossings;
  std::int32_t inner = 0;
  for (const std::int32_t c : best.mesh.curve) inner += c < 0;
  out.quality.good_rays = inner > 0 ? 1 - static_cast<double>(best.relaxed.blind.size()) / inner : 1;
  for (Vec3& at : best.mesh.mesh.position) at += p.centre;
  out.collision = to_triangle_mesh(best.mesh.mesh);
  out.half_thickness = best.mesh.half_thickness;
  mark_what_is_bad(best, out);
  out.seconds.total += total.lap();
  return out;
}

Result<Midsurface> make_midsurface(const TriangleMesh& surface, const MidsurfaceOptions& options) {
  const auto prepared = prepare_midsurface(surface, options.progress);
  if (!prepared) return prepared.error();
  return make_midsurface(*prepared, options);
}

}  // namespace kerf
