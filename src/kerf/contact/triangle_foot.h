// The point of a triangle nearest to a point: the fast version for inner loops (spatial/triangle_queries.h has the careful one).
#pragma once

#include <array>

#include "kerf/base/vec.h"

namespace kerf {

/// The point of a triangle nearest to p: a + v (b - a) + w (c - a), and its squared distance. Weights on edges and corners
/// are exact. Of a triangle without area it is some point nearby.
struct TriangleFoot {
  double square = 0, v = 0, w = 0;
  /// Of the corners, sum 1; exact zeros on edges and corners.
  [[nodiscard]] std::array<double, 3> weights() const { return {v + w >= 1 ? 0 : 1 - v - w, v, w}; }
};
inline TriangleFoot nearest_foot(Vec3 p, const std::array<Vec3, 3>& t) {
  const Vec3 ab = t[1] - t[0], ac = t[2] - t[0], ap = p - t[0];
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return {dot(ap, ap), 0, 0};
  const Vec3 bp = p - t[1];
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return {dot(bp, bp), 1, 0};
  const Vec3 cp = p - t[2];
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return {dot(cp, cp), 0, 1};
  const auto at = [&](double v, double w) {
    const Vec3 d = ap - v * ab - w * ac;
    return TriangleFoot{dot(d, d), v, w};
  };
  const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 > d3) return at(d1 / (d1 - d3), 0);
  if (vb <= 0 && d2 >= 0 && d6 <= 0 && d2 > d6) return at(0, d2 / (d2 - d6));
  const double e = d4 - d3, f = d5 - d6;
  if (va <= 0 && e >= 0 && f >= 0 && e + f > 0) {
    const double w = e / (e + f);
    return at(1 - w, w);
  }
  const double sum = va + vb + vc;
  return sum > 0 ? at(vb / sum, vc / sum) : TriangleFoot{dot(ap, ap), 0, 0};
}

}  // namespace kerf
