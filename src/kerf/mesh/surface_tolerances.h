// Tolerances of the checks of input surfaces, each with its unit and reason.
#pragma once

#include <cstddef>

namespace kerf {

/// Fraction of the diagonal: vertices closer than this lie at one place. Files with six digits round by up to 1e-6 of a coordinate; details
/// of a body that is worth cutting are far larger.
inline constexpr double kWeldTolerance = 1e-7;
/// Fractions of the diagonal, rising: distances that are tried where a surface falls to pieces, to name one that joins it. Files with 3 to 6
/// digits miss by these. Only what is said depends on them.
inline constexpr double kWeldsToTry[] = {1e-6, 1e-5, 1e-4, 1e-3};
/// Fraction of the diagonal: vertices further apart are no copies of each other. Only what is asked for (--weld) meets it. The mean edge is a bound
/// too, so that this one counts for grids of up to 80 x 80. Half and double move nothing else.
inline constexpr double kMostWeld = 0.01;
/// Fraction of the diagonal: lips of a slit are drawn back by this for binding (lips.h), and then put together again. Of a plate of 12 x 8
/// cm whose slit gapes by 7e-6 paths are drawn beside by four edges, from 7e-5 on by as much as without a slit. At half the same slits bind. At
/// double, strips between two cuts of 0.4 % of the diagonal turn over.
inline constexpr double kLipGap = 1e-3;
/// Fraction of the diagonal: a vertex beside a lip that lies this near to what faces it is of the lip too (lip_vertices.h). Lips that binding divided
/// differently miss each other by rounding where walls are flat. Half and double bind the same slits; far more would take thin bodies for slits.
inline constexpr double kOnLip = 1e-4;
/// Cosine: triangles whose normals have less than minus this face each other. Walls of lips have 1, less where they are twisted and divided
/// differently. 0.45 and 0.98 find the same lips.
inline constexpr double kFacingCosine = 0.9;
/// What lies behind a lip goes with it by less: so much less for each unit of way. At half twice as many vertices move; at double half as
/// many, and the same slits bind. At 1 triangles can turn over.
inline constexpr double kLipSlope = 0.25;
/// Lip vertices whose directions are averaged for one of them: enough of a wall of 20 rows. It bounds the time in fine walls. Half and double bind
/// the same slits.
inline constexpr std::size_t kMostAveraged = 400;
/// So often corners of triangles that turn go half as far: what is left is below a thousandth of the gap. At half it is a thirtieth, and the same slits
/// bind; at double nothing is seen of it.
inline constexpr int kMostHalvings = 10;
/// Cosine between a triangle's normals before and after its corners moved: less has turned, by 60 degrees. 0.25 and 0.9 bind the same slits.
inline constexpr double kTurnedCosine = 0.5;
/// Radians: triangles around an edge that make less are at one angle, as walls of the two lips are. In float32 files they are up to 1e-4 apart. Half
/// and double take the same edges apart.
inline constexpr double kSameAngle = 1e-3;
/// Triangles that hang together on the mean, below which a file keeps nothing together: its corners are merged by place. STL has 1,
/// what is indexed hundreds. Half and double judge the same files alike.
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
