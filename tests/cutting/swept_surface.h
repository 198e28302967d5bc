// What strokes of a blade sweep, for comparison with the walls that they leave.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "kerf/cutting/swept_deviation.h"

#include "cutting/stroke_body.h"

namespace kerf::testing_support {

/// How a body lies in the world. `slack`: edges by which a triangle's plane may leave the curve between its corners.
struct Pose {
  Vec3 (*forward)(Vec3);
  Vec3 (*back)(Vec3);
  double slack;
};
inline constexpr Pose kAsItIs{[](Vec3 p) { return p; }, [](Vec3 p) { return p; }, 0};
/// The edges of a stroke, and what they sweep, in the world and at rest.
inline std::vector<BladeEdge> edges_of(const StrokeBody& b, const Stroke& s, int poses) {
  std::vector<BladeEdge> edges{b.edge_at(s[0])};
  for (std::size_t k = 0; k + 1 < s.size(); ++k)
    for (int i = 1; i <= poses; ++i) edges.push_back(b.edge_at(lerp(s[k], s[k + 1], static_cast<double>(i) / poses)));
  return edges;
}
inline TriangleSoup swept_at_rest(std::span<const std::vector<BladeEdge>> strokes, const Pose& pose, double step) {
  TriangleSoup soup;
  for (const std::vector<BladeEdge>& s : strokes)
    for (std::size_t i = 0; i + 1 < s.size(); ++i) {
      const BladeEdge &a = s[i], &b = s[i + 1];
      const auto parts = [&](double length) { return std::max(1, static_cast<int>(std::ceil(length / step))); };
      const int along = parts(norm(a.tip - a.base)), onward = parts(norm(b.base - a.base));
      const auto at = [&](int k, int l) {
        const double u = static_cast<double>(k) / along, w = static_cast<double>(l) / onward;
        return pose.back(lerp(lerp(a.base, a.tip, u), lerp(b.base, b.tip, u), w));
      };
      for (int k = 0; k < along; ++k)
        for (int l = 0; l < onward; ++l) {
          soup.add(at(k, l), at(k + 1, l), at(k + 1, l + 1));
          soup.add(at(k, l), at(k + 1, l + 1), at(k, l + 1));
        }
    }
  soup.build();
  return soup;
}

}  // namespace kerf::testing_support
