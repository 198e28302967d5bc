// How far, hard and heavy things may be in scenes, recordings and the messages of pages: beyond, squares and products of such
// numbers lose all meaning, and nobody means them.
#pragma once

namespace kerf {

inline constexpr double kFarthestPlace = 1e6;                   ///< m: coordinates of whatever is placed or moved
inline constexpr double kLongestTimeStep = 1e3;                 ///< s: falls in steps of 1e8 s took no end
inline constexpr double kHardestForce = 1e6;                    ///< N
inline constexpr double kMostGravity = 1e4;                     ///< m/s2
inline constexpr double kLeastYoung = 1e-3, kMostYoung = 1e13;  ///< Pa: far below foam, and ten times diamond
inline constexpr double kLeastDensity = 1e-3,
                        kMostDensity = 1e6;  ///< kg/m3: far below air, and fifty times the heaviest metal
inline constexpr double kMostDust = 0.1;     ///< of the uncut body's volume: a tenth of a body is no dust

}  // namespace kerf
