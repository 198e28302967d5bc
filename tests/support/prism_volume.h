// How much of a closed surface lies in a convex prism without ends: exact but for rounding.
#pragma once

#include <array>
#include <vector>

#include "kerf/base/vec.h"

namespace kerf::testing_support {

struct Prism {
  Vec3 centre, x, y, axis;    ///< metres; orthonormal
  std::vector<Vec2> outline;  ///< convex, counter-clockwise; metres along x and y
};

/// Cubic metres. A triangle bounds what lies below it along the axis. Its part over the outline is a polygon, on which height is linear.
inline double volume_in_prism(const std::vector<std::array<Vec3, 3>>& surface, const Prism& prism) {
  double sum = 0;
  std::vector<Vec3> part, next;  // x, y, height
  for (const std::array<Vec3, 3>& triangle : surface) {
    part.clear();
    for (const Vec3 corner : triangle) {
      const Vec3 d = corner - prism.centre;
      part.push_back({dot(d, prism.x), dot(d, prism.y), dot(d, prism.axis)});
    }
    for (std::size_t i = 0; i < prism.outline.size() && !part.empty(); ++i) {
      const Vec2 a = prism.outline[i], side = prism.outline[(i + 1) % prism.outline.size()] - a;
      const auto left_of = [&](Vec3 p) { return cross(side, Vec2{p.x, p.y} - a); };
      next.clear();
      for (std::size_t j = 0; j < part.size(); ++j) {
        const Vec3 p = part[j], q = part[(j + 1) % part.size()];
        const double lp = left_of(p), lq = left_of(q);
        if (lp >= 0) next.push_back(p);
        if ((lp >= 0) != (lq >= 0)) next.push_back(lerp(p, q, lp / (lp - lq)));
      }
      part.swap(next);
    }
    for (std::size_t j = 2; j < part.size(); ++j) {
      const Vec3 a = part[0], b = part[j - 1], c = part[j];
      sum += cross(Vec2{b.x - a.x, b.y - a.y}, Vec2{c.x - a.x, c.y - a.y}) * (a.z + b.z + c.z) / 6;
    }
  }
  return sum;
}

}  // namespace kerf::testing_support
