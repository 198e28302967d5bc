// Tolerances of the checks of input surfaces, each with its unit and reason.
#pragma once

#include <cstddef>

namespace kerf {

/// Fraction of the diagonal: vertices closer than this are the same one where the caller asks for it. Files
/// with six digits round by up to 1e-6 of a coordinate; details of a body that is worth cutting are far
/// larger.
inline constexpr double kWeldTolerance = 1e-7;
/// Fraction of the diagonal: lips of a slit are drawn back by this for binding (lips.h), and then put together again. Of a plate of 12 x 8
/// cm whose slit gapes by 7e-6 paths are drawn beside by four edges, from 7e-5 on by as much as without a slit. At double, strips
/// between two cuts of 0.4 % of the diagonal turn over.
inline constexpr double kLipGap = 1e-3;
/// What lies behind a lip goes with it by less: so much less for each unit of way. At 1 triangles could turn over; at half, twice as many
/// vertices move.
inline constexpr double kLipSlope = 0.25;
/// Radians: triangles around an edge that make less are at one angle, as walls of the two lips are. In float32 files they are up to 1e-4 apart.
inline constexpr double kSameAngle = 1e-3;
/// Triangles that hang together on the mean, below which a file keeps nothing together: its corners are merged by place.
inline constexpr double kSoup = 4;

/// Height over longest edge: a flatter triangle has no area, since its normal would be rounding noise.
inline constexpr double kFlatTriangle = 1e-12;
/// Volume over area times diagonal: a closed surface below this is folded flat. Thickness over diagonal is
/// twice this.
inline constexpr double kNoVolume = 1e-12;
/// Fraction of the diagonal: the spacing of doubles at the body must be below this, or cuts lose their
/// accuracy.
inline constexpr double kPositionSpacing = 1e-9;
/// Metres: a diagonal outside is refused, since squares and cubes of lengths and masses lose all meaning
/// there.
inline constexpr double kSmallestDiagonal = 1e-6;
inline constexpr double kLargestDiagonal = 1e6;
/// Metres: a diagonal outside gets a warning, since the file is likely not in metres.
inline constexpr double kUsualSmallest = 1e-3;
inline constexpr double kUsualLargest = 5;
/// Distance from the origin over diagonal: beyond this a warning is due.
inline constexpr double kUsualDistance = 1e3;

/// Triangles at one vertex of a body: what binds one tries each of them for each of them. A sheet with 4,000 and 8,000 takes 0.4 and 1.6
/// s of a core to bind, a plate whose faces are fans of 2,000 and 8,000 takes 2 and 25 s. At half, turned parts with fine lids are
/// refused; at double, one lid costs a minute.
inline constexpr std::size_t kMostAround = 5000;

/// Radians: angles of all triangles at a vertex together, below which it sticks out like a needle. A cone whose sides lean by half a degree has this at its
/// tip; the sharpest tip of the corpus, of a star with 12, has 3.4. Half and double tell the same bodies apart: strays from 240 or 60 edges away.
inline constexpr double kNeedle = 0.05;

}  // namespace kerf
