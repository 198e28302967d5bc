// The largest counts that 32-bit ids can name, the largest texture coordinates, and the most work for a face.
#pragma once

#include <cmath>
#include <cstddef>

namespace kerf {

inline constexpr std::size_t kMaxVertices = 2147483647;       ///< ids are 32 bits, signed
inline constexpr std::size_t kMaxTriangles = 2147483647 / 3;  ///< half-edge ids are 3 triangle + corner

/// Corners looked at for whether they lie in an ear of one face (polygon_faces.h). A comb of 50,000 teeth and a star of 100,000 tips take 32 s together without
/// a limit, in a build with assertions; with it each is given up within 2 s. A star of 5,000 tips passes. Not measured at half and double.
inline constexpr std::size_t kMostEarTests = std::size_t{1} << 27;

/// Texture coordinates count repeats of a picture. Beyond this, sums and products of them in single precision could overflow.
inline constexpr float kMostTexture = 1e9f;
/// Written so that nan fails too.
inline bool is_texture_coordinate(float x) { return std::fabs(x) <= kMostTexture; }

}  // namespace kerf
