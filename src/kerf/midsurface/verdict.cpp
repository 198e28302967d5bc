#include "kerf/midsurface/verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "kerf/mesh/union_find.h"
#include "kerf/midsurface/branches.h"
#include "kerf/midsurface/laplacian.h"
#include "kerf/midsurface/tolerances.h"

namespace kerf::mid {
namespace {

constexpr std::size_t kMostPlaces = 12;

void refuse(MidsurfaceVerdict& v, std::string why) {
  v.thinness = Thinness::kNotThin;
  v.reasons.push_back(std::move(why));
}
void warn(MidsurfaceVerdict& v, std::string why) {
  if (v.thinness == Thinness::kThin) v.thinness = Thinness::kDoubtful;
  v.warnings.push_back(std::move(why));
}

std::string place(Vec3 p) { return fmt::format("({:.4g}, {:.4g}, {:.4g})", p.x, p.y, p.z); }

/// Connected parts of flagged faces, the largest first, as places.
std::size_t add_places(const SurfaceMesh& m, const std::vector<std::uint8_t>& flag, const char* what, Vec3 origin,
                       MidsurfaceVerdict& verdict) {
  UnionFind sets(flag.size());
  for (std::int32_t h = 0; h < m.origin.count(); ++h) {
    if (!m.is_edge(h) || m.twin[h] < 0) continue;
    if (flag[static_cast<std::size_t>(h / 3)] && flag[static_cast<std::size_t>(m.twin[h] / 3)])
      sets.join(h / 3, m.twin[h] / 3);
  }
  std::vector<double> area(flag.size(), 0);
  std::vector<Vec3> sum(flag.size());
  for (std::size_t f = 0; f < flag.size(); ++f) {
    if (!flag[f]) continue;
    const auto r = static_cast<std::size_t>(sets.root(static_cast<std::int32_t>(f)));
    const double a = m.area(static_cast<std::int32_t>(f));
    area[r] += a;
    sum[r] += a * m.centroid(static_cast<std::int32_t>(f));
  }
  std::vector<std::size_t> roots;
  for (std::size_t f = 0; f < flag.size(); ++f)
    if (area[f] > 0) roots.push_back(f);
  std::stable_sort(roots.begin(), roots.end(), [&](std::size_t a, std::size_t b) { return area[a] > area[b]; });
  for (std::size_t i = 0; i < std::min(roots.size(), kMostPlaces); ++i)
    verdict.places.push_back({(1 / area[roots[i]]) * sum[roots[i]] + origin, what});
  return roots.size();
}

/// Volume of the columns over the sheet along its normals, each as high as the body is there.
double columns_on(const MidSheet& sheet, const Column<double>& area, const WorkingMesh& work, const TriangleBvh& bvh) {
  const TriangleView view = work.mesh.view();
  double volume = 0;
  for (std::int32_t v = 0; v < sheet.mesh.vertex_count(); ++v) {
    const Vec3 p = sheet.mesh.position[v], n = sheet.normal[v];
    if (n == Vec3{}) continue;
    const RayHit up = bvh.first_hit(view, {p, n, 0, HUGE_VAL}), down = bvh.first_hit(view, {p, -n, 0, HUGE_VAL});
    if (up.valid() && down.valid()) volume += area[v] * (up.t + down.t);
  }
  return volume;
}

}  // namespace

bool is_stout(const MidsurfaceVerdict& verdict) {
  return verdict.width_over_thickness > 0 && verdict.width_over_thickness < kTooStout;
}

bool judge_sides(const SidesFound& found, MidsurfaceVerdict& verdict, std::vector<std::uint8_t>& flag) {
  const auto& [work, pairing, labels, plus, minus, origin] = found;
  const SurfaceMesh& m = work.mesh;
  verdict.one_sided = labels.one_sided;
  flag.assign(pairing.pair.size(), 0);
  if (minus.face_count() == 0 || plus.face_count() == 0 || labels.one_sided > kAllOneSided) {
    double area = 0;
    for (std::int32_t f = 0; f < m.face_count(); ++f) area += m.area(f);
    const bool wide = std::sqrt(0.5 * area) > kSheetLike * work.thickness;
    refuse(verdict, wide ? "the body has one side only, as a Moebius strip: its mid-surface leads from one side to the "
                           "other; slit it across"
                         : "the body is about as thick as it is wide, as a ball or a cube: it has no two sides");
    return false;
  }
  // Mark what joins a side to itself.
  for (std::int32_t f = 0; f < m.face_count(); ++f) {
    const Pair& q = pairing.pair[f];
    if (q.face < 0 || std::min(q.confidence, pairing.pair[q.face].confidence) < 0.3) continue;
    if ((field_at(m, labels.field, f) > 0) == (field_at(m, labels.field, q.face, q.barycentric) > 0))
      flag[static_cast<std::size_t>(f)] = 1;
  }
  const Branches branches = find_branches(m, pairing, labels);
  verdict.branch_length = branches.length / work.thickness;
  const Topology whole = topology(m), a = topology(plus), b = topology(minus);
  if (2 * a.euler != whole.euler || a != b || a.components != 1) {
    // Where a body branches, the line between its sides leaves the rim.
    add_places(m, branches.flag, "the body branches", origin, verdict);
    for (std::size_t f = 0; f < flag.size(); ++f) flag[f] = flag[f] || branches.flag[f];
    // Islands: parts of a side that hang together with nothing else of it.
    for (const SurfaceMesh* side : {&plus, &minus}) {
      if (topology(*side).components == 1) continue;
      UnionFind sets(side->position.size());
      for (std::int32_t h = 0; h < side->origin.count(); ++h)
        if (side->is_edge(h)) sets.join(side->from(h), side->to(h));
      std::vector<double> area(side->position.size(), 0);
      std::vector<Vec3> sum(side->position.size());
      for (std::int32_t f = 0; f < side->face_count(); ++f) {
        const auto r = static_cast<std::size_t>(sets.root(side->origin[3 * f]));
        area[r] += side->area(f);
        sum[r] += side->area(f) * side->centroid(f);
      }
      const auto largest = std::max_element(area.begin(), area.end()) - area.begin();
      for (std::size_t r = 0; r < area.size() && verdict.places.size() < kMostPlaces; ++r)
        if (area[r] > 0 && static_cast<std::ptrdiff_t>(r) != largest)
          verdict.places.push_back(
              {(1 / area[r]) * sum[r] + origin, "a part of one side that is cut off from the rest"});
    }
    add_places(m, flag, "material meets on three sides", origin, verdict);
    const std::string where = verdict.places.empty() ? std::string() : ", first at " + place(verdict.places[0].point);
    refuse(verdict,
           fmt::format("no sheet has this shape: the body branches, or its rim does not close around it ({} and {} "
                       "parts, {} and {} rims on the two sides{})",
                       a.components, b.components, a.loops, b.loops, where));
    return false;
  }
  for (std::size_t f = 0; f < flag.size(); ++f) flag[f] = flag[f] || branches.flag[f];
  if (verdict.branch_length > kFork) {
    add_places(m, branches.flag, "the body branches", origin, verdict);
    refuse(verdict, fmt::format("the body branches: material of more than two directions meets, first at {}",
                                place(verdict.places[0].point)));
  }
  if (labels.one_sided > kOneSided) {
    const std::size_t n = add_places(m, flag, "material meets on three sides", origin, verdict);
    refuse(verdict, fmt::format("at {} places material meets on three sides (branches, limbs){}: {:.0f} % of the body",
                                std::max<std::size_t>(n, 1),
                                verdict.places.empty() ? "" : ", the largest at " + place(verdict.places[0].point),
                                100 * labels.one_sided));
  }
  return true;
}

void judge_sheet(const MidSheet& sheet, const WorkingMesh& work, const TriangleBvh& bvh, Vec3 origin,
                 MidsurfaceVerdict& verdict) {
  const SurfaceMesh& m = sheet.mesh;
  const bool two_sides = verdict.reasons.empty();
  const Column<double> area = vertex_areas(m);
  double volume = 0, total = 0, widest = 0;
  std::int32_t middle = 0;
  for (std::int32_t v = 0; v < m.vertex_count(); ++v) {
    total += area[v];
    if (sheet.from_border[v] < HUGE_VAL && sheet.from_border[v] > widest) {
      widest = sheet.from_border[v];
      middle = v;
    }
  }
  for (std::int32_t f = 0; f < m.face_count(); ++f)
    for (int k = 0; k < 3; ++k) volume += m.area(f) * 2 * sheet.half_thickness[m.origin[3 * f + k]] / 3;
  const double thickness = volume / total;
  const bool rimless = widest == 0;
  verdict.width_over_thickness = rimless ? HUGE_VAL : 2 * widest / thickness;
  verdict.volume_ratio = volume / std::fabs(enclosed_volume(work.mesh));
  const auto odd = [&] { return verdict.volume_ratio < kLeastVolume || verdict.volume_ratio > kMostVolume; };
  // Sides that lean towards each other up to the rim, as a lens's, are thinner there than half thicknesses go on.
  if (odd()) verdict.volume_ratio = columns_on(sheet, area, work, bvh) / std::fabs(enclosed_volume(work.mesh));

  // Discs from the widest on; what no wide disc covers is narrow.
  double narrow = 0, too_narrow = 0;
  Vec3 narrowest;
  double most_narrow = 0;
  if (!rimless) {
    std::vector<std::int32_t> order(m.position.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::int32_t a, std::int32_t b) { return sheet.from_border[a] > sheet.from_border[b]; });
    std::vector<std::uint8_t> covered(m.position.size(), 0);
    std::vector<std::int32_t> stack;
    for (const std::int32_t v : order) {
      if (covered[static_cast<std::size_t>(v)]) continue;
      const double r = sheet.from_border[v];
      const bool is_narrow = 2 * r < kNarrow * 2 * sheet.half_thickness[v];
      if (r <= 0) continue;
      stack.assign(1, v);
      covered[static_cast<std::size_t>(v)] = 1;
      double mine = 0;
      while (!stack.empty()) {
        const std::int32_t u = stack.back();
        stack.pop_back();
        mine += area[u];
        m.for_each_neighbour(u, [&](std::int32_t w) {
          if (covered[static_cast<std::size_t>(w)] || norm(m.position[w] - m.position[v]) > r) return;
          covered[static_cast<std::size_t>(w)] = 1;
          stack.push_back(w);
        });
      }
      if (!is_narrow) continue;
      narrow += mine;
      if (2 * r < kTooNarrow * 2 * sheet.half_thickness[v]) too_narrow += mine;
      if (mine > most_narrow) {
        most_narrow = mine;
        narrowest = m.position[v];
      }
    }
  }
  verdict.narrow_share = narrow / total;
  verdict.narrowest = narrowest + origin;

  if (is_stout(verdict)) {
    refuse(verdict, fmt::format("the body is only {:.3g} times as wide as thick; below {} it is not thin",
                                verdict.width_over_thickness, kTooStout));
    verdict.places.push_back({m.position[middle] + origin, "the widest place"});
  } else if (!rimless && verdict.width_over_thickness < kStout) {
    warn(verdict, fmt::format("the body is only {:.3g} times as wide as thick; the method is meant for {} and more",
                              verdict.width_over_thickness, kStout));
  }
  if (too_narrow > kNarrowShare * total) {
    refuse(verdict, fmt::format("{:.0f} % of the body are locally about as narrow as thick, most of it at {}",
                                100 * too_narrow / total, place(verdict.narrowest)));
    verdict.places.push_back({verdict.narrowest, "as narrow as thick"});
  }
  // A hole narrower than the body is thick takes as many triangles as the rest, if there is one at all: scans have such faults.
  std::size_t pinholes = 0;
  Vec3 first_pinhole;
  for (const std::vector<std::int32_t>& loop : border_loops(m)) {
    double length = 0;
    for (std::size_t i = 0; i < loop.size(); ++i)
      length += norm(m.position[loop[(i + 1) % loop.size()]] - m.position[loop[i]]);
    if (!(length < kPinhole * thickness)) continue;
    if (pinholes++ == 0) first_pinhole = m.position[loop[0]] + origin;
    verdict.places.push_back({m.position[loop[0]] + origin, "a hole narrower than the body is thick"});
  }
  if (pinholes > 0)
    warn(
        verdict,
        fmt::format(
            "{} hole(s) through the body are narrower than it is thick, the first at {}; if the scan left them, fill them",
            pinholes, place(first_pinhole)));
  if (two_sides && odd())
    refuse(verdict,
           fmt::format("the mid-surface times the thickness makes {:.0f} % of the volume: a sheet does not stand for "
                       "this body",
                       100 * verdict.volume_ratio));
}

}  // namespace kerf::mid
