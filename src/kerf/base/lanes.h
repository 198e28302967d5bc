// Four doubles at once. All kernels work on four lanes whatever the machine has, and never fuse multiply and
// add, so the same source gives the same bits on every instruction set.
#pragma once

#include <cstring>

namespace kerf {

using Lanes = double __attribute__((vector_size(32)));

inline Lanes load_lanes(const double* p) {
  Lanes v;
  std::memcpy(&v, p, sizeof v);
  return v;
}
inline void store_lanes(double* p, const Lanes& v) { std::memcpy(p, &v, sizeof v); }
inline Lanes all_lanes(double x) { return Lanes{x, x, x, x}; }

/// Rows (a, b, c, d) to columns, in place.
inline void transpose_lanes(Lanes& a, Lanes& b, Lanes& c, Lanes& d) {
  const Lanes ab_even = __builtin_shufflevector(a, b, 0, 4, 2, 6), ab_odd = __builtin_shufflevector(a, b, 1, 5, 3, 7);
  const Lanes cd_even = __builtin_shufflevector(c, d, 0, 4, 2, 6), cd_odd = __builtin_shufflevector(c, d, 1, 5, 3, 7);
  a = __builtin_shufflevector(ab_even, cd_even, 0, 1, 4, 5);
  b = __builtin_shufflevector(ab_odd, cd_odd, 0, 1, 4, 5);
  c = __builtin_shufflevector(ab_even, cd_even, 2, 3, 6, 7);
  d = __builtin_shufflevector(ab_odd, cd_odd, 2, 3, 6, 7);
}

/// Cross product of (x, y, z, -) vectors.
inline Lanes cross_lanes(const Lanes& a, const Lanes& b) {
  const Lanes a1 = __builtin_shufflevector(a, a, 1, 2, 0, 3), b1 = __builtin_shufflevector(b, b, 1, 2, 0, 3);
  const Lanes c = a * b1 - a1 * b;  // (z, x, y)
  return __builtin_shufflevector(c, c, 1, 2, 0, 3);
}

}  // namespace kerf
