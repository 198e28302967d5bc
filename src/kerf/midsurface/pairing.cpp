#include "kerf/midsurface/pairing.h"

#include <algorithm>
#include <cmath>

#include "kerf/base/parallel.h"
#include "kerf/mesh/union_find.h"

namespace kerf::mid {
namespace {

constexpr std::size_t kPairGrain = 256, kAskedBlock = 8192;  // faces
constexpr double kSideFacing = 4;                      // power: walls that lean by 60 degrees must not count as a side
constexpr double kMedial = 0.98, kMedialStout = 0.85;  // of the way to the middle: what is farther counts as medial
constexpr double kStoutPair = 2.4;                     // mean thicknesses
constexpr double kSameSurface = 0.7071067811865476;    // cosine: farther turned neighbours lie across a crease

// Facets (what creases bound) whose pairs are this sure, as a share of the surest large facet's, are walls of the rim and sides. Walls of
// stars, plates with holes and combs have 0 to 0.24; sides 0.6 to 1, the lip of a lid 0.3.
constexpr double kWallFacet = 0.25, kSideFacet = 0.5;
constexpr double kLargeFacet = 0.1;    // of the whole area
constexpr double kFacesItself = 0.01;  // of the sureness of a facet: such facets go around the rim

template <class Fn>
void for_each_face(const SurfaceMesh& m, Fn&& fn) {
  parallel_for(static_cast<std::size_t>(m.face_count()), kPairGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) fn(static_cast<std::int32_t>(f));
  });
}

Column<Vec3> smoothed_normals(const SurfaceMesh& m, const Column<Vec3>& own) {
  const auto faces = static_cast<std::size_t>(m.face_count());
  Column<Vec3> normal(faces);
  Column<double> area(faces);
  for_each_face(m, [&](std::int32_t f) { area[f] = m.area(f); });
  normal = own;
  for (int round = 0; round < 2; ++round) {
    Column<Vec3> next(faces);
    for_each_face(m, [&](std::int32_t f) {
      Vec3 sum;
      for (int k = 0; k < 3; ++k)
        m.for_each_outgoing(m.origin[3 * f + k], [&](std::int32_t h) {
          const std::int32_t g = h / 3;
          if (dot(own[f], own[g]) > kSameSurface) sum += area[g] * normal[g];
        });
      next[f] = sum == Vec3{} ? own[f] : normalized(sum);
    });
    normal = std::move(next);
  }
  return normal;
}

/// Where a body is narrower than it is thick, as in a tip or between a hole and the rim, its walls face each other as surely as its sides do.
/// A facet tells them apart as a whole: most of a wall is far from the wall opposite. Smaller facets than a thickness squared have no say.
void weigh_facets(const SurfaceMesh& m, const Column<Vec3>& own, double thickness, Pairing& p) {
  UnionFind facets(p.pair.size());
  for (std::int32_t h = 0; h < m.origin.count(); ++h)
    if (m.is_edge(h) && dot(own[h / 3], own[m.twin[h] / 3]) > kSameSurface) facets.join(h / 3, m.twin[h] / 3);
  Column<double> area(p.pair.size(), 0), sure(p.pair.size(), 0), of_itself(p.pair.size(), 0);
  double total = 0, surest = 0;
  for (std::int32_t f = 0; f < m.face_count(); ++f) {
    const std::int32_t facet = facets.root(f);
    const double here = m.area(f) * p.pair[f].confidence;
    area[facet] += m.area(f);
    sure[facet] += here;
    if (p.pair[f].face >= 0 && facets.root(p.pair[f].face) == facet) of_itself[facet] += here;
    total += m.area(f);
  }
  for (std::int32_t f = 0; f < m.face_count(); ++f)
    if (area[f] > kLargeFacet * total) surest = std::max(surest, sure[f] / area[f]);
  if (surest == 0) return;
  for (std::int32_t f = 0; f < m.face_count(); ++f) {
    const std::int32_t facet = facets.root(f);
    if (area[facet] < thickness * thickness) continue;
    const double share = sure[facet] / area[facet] / surest;
    const double side = std::clamp((share - kWallFacet) / (kSideFacet - kWallFacet), 0.0, 1.0);
    p.pair[f].confidence *= side;
    if (side == 1 && of_itself[facet] < kFacesItself * sure[facet]) p.of_facet[f] = sure[facet] / area[facet];
  }
}

}  // namespace

Result<Pairing> find_pairs(const SurfaceMesh& m, const TriangleBvh& bvh, double thickness, const Progress& progress) {
  Pairing out;
  Column<Vec3> own(static_cast<std::size_t>(m.face_count()));
  for_each_face(m, [&](std::int32_t f) { own[f] = normalized(m.area_vector(f)); });
  out.normal = smoothed_normals(m, own);
  out.pair.resize(static_cast<std::size_t>(m.face_count()));
  const TriangleView view = m.view();
  const auto find = [&](std::int32_t f) {
    const Vec3 c = m.centroid(f), n = out.normal[f];
    Pair& p = out.pair[f];
    const RayHit hit =
        bvh.first_hit(view, {c, -n, 1e-6 * thickness, HUGE_VAL}, [&](const RayHit& h) { return h.triangle != f; });
    if (!hit.valid()) return;
    p.face = hit.triangle;
    p.barycentric = hit.barycentric;
    p.distance = hit.t;
    const double facing = std::max(0.0, -dot(n, out.normal[hit.triangle]));
    if (facing == 0) return;  // of no confidence, however much room there is
    const double half = 0.5 * hit.t;
    // Anything farther than that counts as half the way: in the middle of a ball everything is equally far.
    // The more so the stouter the body is there: boxes of triangles reach inwards too, and all of them would be opened.
    const double medial = hit.t > kStoutPair * thickness ? kMedialStout : kMedial;
    const double room = bvh.closest(view, c - half * n, medial * half).distance;
    const double rho = std::min(1.0, room / half);
    p.confidence = std::pow(facing, kSideFacing) * rho * rho * rho;
  };
  const std::size_t faces = out.pair.size();
  for (std::size_t from = 0; from < faces; from += kAskedBlock) {
    KERF_TRY(progress("mid-surface: pairs", static_cast<double>(from) / static_cast<double>(faces)));
    parallel_for(std::min(kAskedBlock, faces - from), kPairGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t f = from + begin; f < from + end; ++f) find(static_cast<std::int32_t>(f));
    });
  }
  out.of_facet.assign(out.pair.size(), 0);
  weigh_facets(m, own, thickness, out);
  double sum = 0, area = 0;
  for (std::int32_t f = 0; f < m.face_count(); ++f) {
    sum += m.area(f) * out.pair[f].confidence;
    area += m.area(f);
  }
  out.mean_confidence = sum / area;
  return out;
}

}  // namespace kerf::mid
