// Triangles into pixels.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "kerf/base/vec.h"

namespace kerf {

inline std::size_t picture_index(std::int32_t i) { return static_cast<std::size_t>(i); }

/// Calls f(x, y, weights of a, b, c) for the pixel centres inside a triangle, rows first_row .. end_row - 1
/// only.
template <class F>
void fill_triangle(Vec2 a, Vec2 b, Vec2 c, int width, int first_row, int end_row, F&& f) {
  const double area = cross(b - a, c - a);
  if (area == 0 || !std::isfinite(area)) return;
  const double low_y = std::min({a.y, b.y, c.y}), high_y = std::max({a.y, b.y, c.y});
  const double low_x = std::min({a.x, b.x, c.x}), high_x = std::max({a.x, b.x, c.x});
  if (high_y < first_row || low_y > end_row || high_x < 0 || low_x > width) return;
  const int y0 = static_cast<int>(std::max<double>(first_row, std::ceil(low_y - 0.5))),
            y1 = static_cast<int>(std::min<double>(end_row - 1, std::floor(high_y - 0.5)));
  const int x0 = static_cast<int>(std::max<double>(0, std::ceil(low_x - 0.5))),
            x1 = static_cast<int>(std::min<double>(width - 1, std::floor(high_x - 0.5)));
  const double inverse = 1 / area;
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      const Vec2 p{x + 0.5, y + 0.5};
      const double wa = cross(c - b, p - b) * inverse, wb = cross(a - c, p - c) * inverse, wc = 1 - wa - wb;
      if (wa >= 0 && wb >= 0 && wc >= 0) f(x, y, wa, wb, wc);
    }
  }
}

}  // namespace kerf
