// The largest counts that 32-bit ids can name.
#pragma once

#include <cstddef>

namespace kerf {

inline constexpr std::size_t kMaxVertices = 2147483647;       ///< ids are 32 bits, signed
inline constexpr std::size_t kMaxTriangles = 2147483647 / 3;  ///< half-edge ids are 3 triangle + corner

}  // namespace kerf
