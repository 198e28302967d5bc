// Length of (x, y), the same bits on every machine: C libraries differ in the last bit of hypot.
#pragma once

#include <cmath>

namespace kerf {

/// Within 1 ulp (C. F. Borges, "An improved algorithm for hypot(a,b)", 2019). The bits are those of glibc 2.35. Squares must neither
/// overflow nor vanish: for lengths between 1e-140 and 1e140, and 0.
inline double hypotenuse(double x, double y) {
  x = std::fabs(x);
  y = std::fabs(y);
  const double a = x < y ? y : x, b = x < y ? x : y;
  if (b <= 0x1p-54 * a) return a + b;
  const double h = std::sqrt(a * a + b * b);
  double error = 0;  // of the square of h
  if (h <= 2 * b) {
    const double d = h - b;
    error = a * (2 * d - a) + (d - 2 * (a - b)) * d;
  } else {
    const double d = h - a;
    error = 2 * d * (a - 2 * b) + ((4 * d - b) * b + d * d);
  }
  return h - error / (2 * h);
}

}  // namespace kerf
