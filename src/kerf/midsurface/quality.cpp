#include "kerf/midsurface/quality.h"

#include <algorithm>
#include <cmath>

#include "kerf/base/parallel.h"
#include "kerf/midsurface/triangle_shape.h"

namespace kerf::mid {
namespace {

constexpr std::size_t kQualityGrain = 2048;
constexpr int kSamples = 6;  // per edge of a prism's face

/// Largest and mean distance of points to a surface.
struct Distances {
  double mean = 0, max = 0;
};
Distances distances(const std::vector<Vec3>& points, const TriangleView& view, const TriangleBvh& bvh) {
  const std::size_t chunks = (points.size() + kQualityGrain - 1) / kQualityGrain;
  std::vector<double> sum(chunks, 0), max(chunks, 0);
  parallel_for(points.size(), kQualityGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const double d = bvh.closest(view, points[i]).distance;
      sum[begin / kQualityGrain] += d;
      max[begin / kQualityGrain] = std::max(max[begin / kQualityGrain], d);
    }
  });
  Distances out;
  for (std::size_t c = 0; c < chunks; ++c) {
    out.mean += sum[c] / static_cast<double>(points.size());
    out.max = std::max(out.max, max[c]);
  }
  return out;
}

}  // namespace

TriangleMesh prism_surface(const SurfaceMesh& m, const Column<double>& half_thickness) {
  TriangleMesh out;
  const Column<Vec3> normal = vertex_normals(m);
  const std::int32_t n = m.vertex_count();
  for (const double side : {1.0, -1.0})
    for (std::int32_t v = 0; v < n; ++v) out.positions.push_back(m.position[v] + side * half_thickness[v] * normal[v]);
  const auto add = [&](std::int32_t a, std::int32_t b, std::int32_t c) {
    out.triangles.push_back({VertexId(a), VertexId(b), VertexId(c)});
  };
  for (std::int32_t f = 0; f < m.face_count(); ++f) {
    const std::int32_t a = m.origin[3 * f], b = m.origin[3 * f + 1], c = m.origin[3 * f + 2];
    add(a, b, c);
    add(n + a, n + c, n + b);
  }
  for (std::int32_t h = 0; h < m.origin.count(); ++h) {
    if (m.twin[h] >= 0) continue;
    const std::int32_t a = m.from(h), b = m.to(h);
    add(b, a, n + a);
    add(b, n + a, n + b);
  }
  return out;
}

MidsurfaceQuality measure_quality(const CoarseMesh& c, const QualityInput& in) {
  const SurfaceMesh& m = c.mesh;
  MidsurfaceQuality out;
  out.smallest_angle = HUGE_VAL;
  for (std::int32_t f = 0; f < m.face_count(); ++f) {
    const auto [p, q, r] = m.corners(f);
    const double a = smallest_angle(p, q, r);
    out.smallest_angle = std::min(out.smallest_angle, a);
    out.mean_smallest_angle += a / m.face_count();
  }
  double inner = 0, spanning = 0;
  for (std::int32_t h = 0; h < m.origin.count(); ++h) {
    if (!m.is_edge(h) || m.twin[h] < 0) continue;
    ++inner;
    spanning += c.curve[m.from(h)] >= 0 && c.curve[m.to(h)] >= 0;
  }
  out.spanning_edges = inner > 0 ? spanning / inner : 0;

  const TriangleView view = in.work.view();
  std::vector<std::int32_t> rim;  // its edges, as flat triangles
  for (std::int32_t h = 0; h < m.origin.count(); ++h)
    if (m.twin[h] < 0) rim.insert(rim.end(), {m.from(h), m.to(h), m.to(h)});
  const TriangleView rim_view(m.position, std::span<const std::int32_t>(rim));
  const TriangleBvh rim_bvh(rim_view);
  int vertices = 0, far_from_rim = 0;
  for (std::int32_t v = 0; v < m.vertex_count(); ++v) {
    out.mean_half_thickness += c.half_thickness[v] / m.vertex_count();
    if (c.curve[v] >= 0) continue;
    const auto distance = [&](bool plus) {
      return in.bvh
          .closest(view, m.position[v], HUGE_VAL,
                   [&](const ClosestPoint& q) {
                     return (field_at(in.work, in.labels.field, q.triangle, q.barycentric) > 0) == plus;
                   })
          .distance;
    };
    const double plus = distance(true), minus = distance(false), sum = plus + minus;
    if (!(sum > 0 && sum < HUGE_VAL)) continue;
    const double medial = std::fabs(plus - minus) / sum, thickness = std::fabs(2 * c.half_thickness[v] - sum) / sum;
    out.medial_mean += medial;
    out.medial_max = std::max(out.medial_max, medial);
    ++vertices;
    // Next to the rim the closest points of both sides are on its wall, and say nothing about the thickness.
    if (!rim.empty() && rim_bvh.closest(rim_view, m.position[v]).distance < 1.2 * c.half_thickness[v]) continue;
    out.thickness_mean += thickness;
    out.thickness_max = std::max(out.thickness_max, thickness);
    ++far_from_rim;
  }
  if (vertices > 0) out.medial_mean /= vertices;
  if (far_from_rim > 0) out.thickness_mean /= far_from_rim;

  const TriangleMesh prisms = prism_surface(m, c.half_thickness);
  const TriangleView prism_view(prisms);
  const TriangleBvh prism_bvh(prism_view);
  const Distances to_prisms = distances(in.visual, prism_view, prism_bvh);
  out.to_prisms_mean = to_prisms.mean;
  out.to_prisms_max = to_prisms.max;
  std::vector<Vec3> samples;
  for (std::size_t f = 0; f < prisms.triangles.size(); ++f) {
    const auto [p, q, r] = prism_view[static_cast<std::int32_t>(f)];
    for (int i = 0; i <= kSamples; ++i)
      for (int j = 0; i + j <= kSamples; ++j) {
        const double u = static_cast<double>(i) / kSamples, w = static_cast<double>(j) / kSamples;
        samples.push_back((1 - u - w) * p + u * q + w * r);
      }
  }
  out.to_visual_max = distances(samples, view, in.bvh).max;
  return out;
}

}  // namespace kerf::mid
