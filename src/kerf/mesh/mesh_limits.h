// The largest counts that 32-bit ids can name, and the largest texture coordinates.
#pragma once

#include <cmath>
#include <cstddef>

namespace kerf {

inline constexpr std::size_t kMaxVertices = 2147483647;       ///< ids are 32 bits, signed
inline constexpr std::size_t kMaxTriangles = 2147483647 / 3;  ///< half-edge ids are 3 triangle + corner

/// Texture coordinates count repeats of a picture. Beyond this, sums and products of them in single precision could overflow.
inline constexpr float kMostTexture = 1e9f;
/// Written so that nan fails too.
inline bool is_texture_coordinate(float x) { return std::fabs(x) <= kMostTexture; }

}  // namespace kerf
