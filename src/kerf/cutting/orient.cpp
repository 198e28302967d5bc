#include "kerf/cutting/orient.h"

namespace kerf::cut {

double orient2d_exact(Vec2 a, Vec2 b, Vec2 c) {
  // a.x b.y - a.y b.x + b.x c.y - b.y c.x + c.x a.y - c.y a.x as a non-overlapping expansion.
  const double factor[6][2] = {{a.x, b.y}, {-a.y, b.x}, {b.x, c.y}, {-b.y, c.x}, {c.x, a.y}, {-c.y, a.x}};
  double part[12];
  int n = 0;
  const auto add = [&](double q) {  // Shewchuk's grow-expansion, zeros dropped
    int kept = 0;
    for (int i = 0; i < n; ++i) {
      const double sum = q + part[i];
      const double virtual_part = sum - q;
      const double error = (q - (sum - virtual_part)) + (part[i] - virtual_part);
      if (error != 0) part[kept++] = error;
      q = sum;
    }
    if (q != 0) part[kept++] = q;
    n = kept;
  };
  for (const auto& f : factor) {
    const double product = f[0] * f[1];
    add(std::fma(f[0], f[1], -product));
    add(product);
  }
  double sum = 0;
  for (int i = 0; i < n; ++i) sum += part[i];
  return sum;
}

}  // namespace kerf::cut
