#include "kerf/midsurface/relax.h"

#include <algorithm>
#include <cmath>

#include "kerf/midsurface/triangle_shape.h"

namespace kerf::mid {
namespace {

constexpr int kRounds = 5;
constexpr double kRelaxStep = 0.4, kLeash = 0.6;         // of the half thickness
constexpr double kSharpest = 24 * 0.017453292519943295;  // no move makes a sharper angle sharper still
constexpr double kMostTurn = 0.31;
constexpr double kFold = 0.2;  // cosine: no move folds neighbours more than by 78 degrees
constexpr double kOddRay = 2;  // times the sheet's half thickness: such a ray runs along the sheet

/// The smallest angle around v were it at `place`; -1 where a face would turn over.
double angle_at(const SurfaceMesh& m, std::int32_t v, Vec3 place) {
  double least = HUGE_VAL;
  const Vec3 o = m.position[v];
  m.for_each_outgoing(v, [&](std::int32_t e) {
    const Vec3 p = m.position[m.to(e)], q = m.position[m.apex(e)];
    const Vec3 old = cross(p - o, q - o), now = cross(p - place, q - place);
    least = std::min(least, dot(old, now) > kMostTurn * norm(old) * norm(now) ? smallest_angle(place, p, q) : -1);
  });
  return least;
}

/// The sharpest fold at the edges around v and between them, were it at `place`: the smallest cosine between neighbours.
double fold_at(const SurfaceMesh& m, std::int32_t v, Vec3 place) {
  double least = 1;
  const auto normal = [&](std::int32_t f) {
    Vec3 p[3];
    for (int k = 0; k < 3; ++k) {
      const std::int32_t u = m.origin[3 * f + k];
      p[k] = u == v ? place : m.position[u];
    }
    return triangle_normal(p[0], p[1], p[2]);
  };
  m.for_each_outgoing(v, [&](std::int32_t e) {
    const Vec3 n = normal(e / 3);
    for (const std::int32_t h : {e, SurfaceMesh::next(e)})
      if (m.twin[h] >= 0) least = std::min(least, dot(n, normal(m.twin[h] / 3)));
  });
  return least;
}

/// Moves v by as much of `move` as the triangles around it bear.
void try_move(SurfaceMesh& m, std::int32_t v, Vec3 move) {
  const double before = angle_at(m, v, m.position[v]), fold = fold_at(m, v, m.position[v]);
  for (int halving = 0; halving < 3; ++halving, move = 0.5 * move) {
    const double after = angle_at(m, v, m.position[v] + move);
    if (after < 0 || (after < kSharpest && after < before)) continue;
    if (fold_at(m, v, m.position[v] + move) < std::min(kFold, fold)) continue;
    m.position[v] += move;
    return;
  }
}

void smooth_tangentially(CoarseMesh& c) {
  SurfaceMesh& m = c.mesh;
  for (std::int32_t v = 0; v < m.vertex_count(); ++v) {
    if (c.curve[v] >= 0) continue;
    Vec3 sum;
    double weight = 0;
    m.for_each_outgoing(v, [&](std::int32_t e) {
      const Vec3 p = m.position[m.to(e)], q = m.position[m.apex(e)], o = m.position[v];
      const double s = c.size[v] + c.size[m.to(e)] + c.size[m.apex(e)], w = norm(cross(p - o, q - o)) / (s * s);
      sum += (w / 3) * (o + p + q);
      weight += w;
    });
    if (!(weight > 0)) continue;
    const Vec3 n = vertex_normal(m, v);
    Vec3 move = (1 / weight) * sum - m.position[v];
    move = move - dot(move, n) * n;
    try_move(m, v, move);
  }
}

}  // namespace

RelaxReport relax_to_middle(CoarseMesh& c, const SheetSampler& sampler, const SheetSizes& sizes,
                            const TwoSidedRays& rays) {
  SurfaceMesh& m = c.mesh;
  RelaxReport report;
  for (int round = 0; round < kRounds; ++round) {
    for (std::int32_t v = 0; v < m.vertex_count(); ++v) {
      if (c.curve[v] >= 0) continue;
      const SheetSampler::Sample here = sampler.closest(m.position[v], c.normal[v], sizes.size);
      const auto hit = rays.cast(m.position[v], vertex_normal(m, v));
      if (!hit) continue;
      const double half = 0.5 * (hit->plus + hit->minus);
      if (half > kOddRay * here.half_thickness) continue;
      c.half_thickness[v] = half;
      if (!here.trusted) continue;  // next to the rim the sheet goes straight on, not into a corner of the wall
      const double way = std::clamp(0.5 * (hit->plus - hit->minus), -kRelaxStep * half, kRelaxStep * half);
      Vec3 place = m.position[v] + way * hit->direction;
      const SheetSampler::Sample s = sampler.closest(place, c.normal[v], sizes.size);
      const double leash = kLeash * s.half_thickness;
      if (s.distance > leash && s.distance < HUGE_VAL) place = s.point + (leash / s.distance) * (place - s.point);
      try_move(m, v, place - m.position[v]);
    }
    if (round + 1 < kRounds) {
      for (int i = 0; i < 2; ++i) smooth_tangentially(c);
      flip_for_angles(c);
    }
  }
  const Column<Vec3> normal = vertex_normals(m);
  for (std::int32_t v = 0; v < m.vertex_count(); ++v) {
    if (c.curve[v] >= 0) continue;
    auto hit = rays.cast(m.position[v], normal[v]);
    if (!hit) {  // next to a wall a smoother normal may see both sides
      Vec3 around = normal[v];
      m.for_each_neighbour(v, [&](std::int32_t u) { around += normal[u]; });
      hit = rays.cast(m.position[v], normalized(around));
    }
    if (hit) {
      c.half_thickness[v] = 0.5 * (hit->plus + hit->minus);
      continue;
    }
    // Next to the rim rays meet its wall, which is of neither side.
    const SheetSampler::Sample here = sampler.closest(m.position[v], c.normal[v], sizes.size);
    if (here.trusted) report.blind.push_back(v);
    else c.half_thickness[v] = here.half_thickness;
  }
  // The rim's wall: the half thickness found as far inside as it is high (a fixed point).
  for (std::int32_t v = 0; v < m.vertex_count(); ++v) {
    if (c.curve[v] < 0) continue;
    Vec3 inward;
    double nearby = 0;
    int n = 0;
    m.for_each_neighbour(v, [&](std::int32_t u) {
      inward += m.position[u] - m.position[v];
      nearby = std::max(nearby, norm(m.position[u] - m.position[v]));
      ++n;
    });
    inward = inward - dot(inward, normal[v]) * normal[v];
    const Vec3 in = normalized(inward);
    const double most = kOddRay * sampler.closest(m.position[v], c.normal[v], sizes.size).half_thickness;
    double x = 0.1 * nearby, half = 0;
    for (int round = 0; round < 8 && x > 0; ++round) {
      const auto hit = rays.cast(m.position[v] + x * in, normal[v]);
      half = hit ? std::min(0.5 * (hit->plus + hit->minus), most) : 0;
      if (half > 0 && std::fabs(half - x) < 1e-3 * half) break;
      x = half > 0 ? std::min({half, 2 * x, nearby}) : 0.5 * x;
    }
    c.half_thickness[v] = half;
  }
  return report;
}

}  // namespace kerf::mid
