#include "kerf/midsurface/pairing.h"

#include <algorithm>
#include <cmath>

#include "kerf/base/parallel.h"

namespace kerf::mid {
namespace {

constexpr std::size_t kPairGrain = 1024;
constexpr double kSideFacing = 4;                      // power: walls that lean by 60 degrees must not count as a side
constexpr double kMedial = 0.98, kMedialStout = 0.85;  // of the way to the middle: what is farther counts as medial
constexpr double kStoutPair = 2.4;                     // mean thicknesses
constexpr double kSameSurface = 0.7071067811865476;    // cosine: farther turned neighbours lie across a crease

template <class Fn>
void for_each_face(const SurfaceMesh& m, Fn&& fn) {
  parallel_for(static_cast<std::size_t>(m.face_count()), kPairGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) fn(static_cast<std::int32_t>(f));
  });
}

Column<Vec3> smoothed_normals(const SurfaceMesh& m) {
  const auto faces = static_cast<std::size_t>(m.face_count());
  Column<Vec3> own(faces), normal(faces);
  Column<double> area(faces);
  for_each_face(m, [&](std::int32_t f) {
    const Vec3 n = m.area_vector(f);
    area[f] = norm(n);
    own[f] = normalized(n);
  });
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

}  // namespace

Pairing find_pairs(const SurfaceMesh& m, const TriangleBvh& bvh, double thickness) {
  Pairing out;
  out.normal = smoothed_normals(m);
  out.pair.resize(static_cast<std::size_t>(m.face_count()));
  const TriangleView view = m.view();
  for_each_face(m, [&](std::int32_t f) {
    const Vec3 c = m.centroid(f), n = out.normal[f];
    Pair& p = out.pair[f];
    const RayHit hit =
        bvh.first_hit(view, {c, -n, 1e-6 * thickness, HUGE_VAL}, [&](const RayHit& h) { return h.triangle != f; });
    if (!hit.valid()) return;
    p.face = hit.triangle;
    p.barycentric = hit.barycentric;
    p.distance = hit.t;
    const double facing = std::max(0.0, -dot(n, out.normal[hit.triangle]));
    const double half = 0.5 * hit.t;
    // Anything farther than that counts as half the way: in the middle of a ball everything is equally far.
    // The more so the stouter the body is there: boxes of triangles reach inwards too, and all of them would be opened.
    const double medial = hit.t > kStoutPair * thickness ? kMedialStout : kMedial;
    const double room = bvh.closest(view, c - half * n, medial * half).distance;
    const double rho = std::min(1.0, room / half);
    p.confidence = std::pow(facing, kSideFacing) * rho * rho * rho;
  });
  double sum = 0, area = 0;
  for (std::int32_t f = 0; f < m.face_count(); ++f) {
    sum += m.area(f) * out.pair[f].confidence;
    area += m.area(f);
  }
  out.mean_confidence = sum / area;
  return out;
}

}  // namespace kerf::mid
