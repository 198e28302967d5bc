// Eight floats at once, whatever the machine has.
#pragma once

#include <cstdint>

namespace kerf {

using Eight = float __attribute__((vector_size(32)));
using EightBits = std::int32_t __attribute__((vector_size(32)));

inline Eight all_eight(float x) { return Eight{x, x, x, x, x, x, x, x}; }
inline Eight lesser(const Eight& a, const Eight& b) { return a < b ? a : b; }
inline Eight greater(const Eight& a, const Eight& b) { return a > b ? a : b; }

/// One bit for every lane that is zero; lanes are 0 or -1.
inline unsigned zeros(const EightBits& v) {
  const EightBits bits = v & EightBits{1, 2, 4, 8, 16, 32, 64, 128};
  const EightBits two = bits | __builtin_shufflevector(bits, bits, 4, 5, 6, 7, 0, 1, 2, 3);
  const EightBits four = two | __builtin_shufflevector(two, two, 2, 3, 0, 1, 2, 3, 0, 1);
  return ~static_cast<unsigned>(four[0] | four[1]) & 0xffu;
}

}  // namespace kerf
