// Numbers that decide how fine a collision mesh is, and which surfaces none is made of.
#pragma once

#include <cstddef>

namespace kerf::mid {

/// Triangles of a collision mesh whose bends ask for fewer. Origin: the paper's models have 67 to 137. At half of it a flat sheet has half as many; at
/// double a mesh no longer depends on the shape alone (Midsurface.FineAndCoarseInputsAgree).
inline constexpr double kDefaultTriangles = 160;

/// Radians by which a border turns at a corner, which is a vertex of the collision mesh: within 0.7 of the wanted length, or of the shortest edge of a hollow.
inline constexpr double kCornerTurn = 0.9;
/// Mean edges by which a border edge of a hole or hollow may cover what is none of the body. Origin: 0.3 of the minimum feature of cuts. At half and at double none of 60
/// blades that dip into a hole leaves a film; where borders are hexagons, 7 of 20 in one of three holes do.
inline constexpr double kHollow = 0.007;
/// Mean edges, and thicknesses at the border: no border edge is made shorter for that, and what turns within it is a corner. Origin: the sheet is not known better next to
/// its rim. At half, a scanned meniscus is missed by 0.58 half thicknesses next to its rim, for less than 0.5. At double, blades that dip into holes of 4 to 20 mm in a
/// plate of 3 mm leave no film either, but its smaller holes are hexagons. Half or double of the first: all bodies of the
/// corpus bind.
inline constexpr double kLeastHollowEdge = 0.1, kHollowThickness = 0.75;

/// Shortest edges at a corner of the border within which the body's farthest vertex is its tip. Half or double: tips of stars are reached, and slits bind.
inline constexpr double kTipReach = 0.25;
/// Of that reach: vertices as far out are the same tip, above and below. Origin: rounding of files.
inline constexpr double kTipSame = 1e-3;

/// Triangles that bends may ask for by themselves; a sheet with no more is its own collision mesh. Origin: cutting and contact cost a share
/// for each of them. The corpus of thin bodies passes its tests with half and with double.
inline constexpr double kMostByNeed = 1500;

// --- Verdicts. What half and double change was measured on the corpus of 71 bodies, four plates of the tests and ten models. ---

/// Share of the sure pairs that join a side to itself: where it is larger, the body has no two sides. Origin: balls, rods with round ends and
/// the strip with half a twist have 1, solid rings 0.09. Half and double change no verdict.
inline constexpr double kAllOneSided = 0.6;
/// The same share where a body branches. Origin: branches have up to 0.3, thin bodies at most 0.0006. Half and double change no verdict: what has
/// more is refused for its forks or its width already.
inline constexpr double kOneSided = 0.03;

/// Length of the forks of a body that branches, in mean thicknesses. Origin: branches have 8 and more, thin bodies none. Half and double
/// change no verdict.
inline constexpr double kFork = 2;

/// Width over thickness below which a body is not thin. Origin: cubes, rods and bars have 1.1 to 1.5, the stoutest slab that binds 3.2. At half cubes
/// and a rod are taken for thin; at double slabs, frames, lenses and plates with holes are refused, eight of the corpus.
inline constexpr double kTooStout = 2;
/// Share of its box that a body fills whose box says how wide and thick it is. Origin: a bar lying on its edge fills 0.5, a round rod 0.79, a
/// ball 0.52. At half, bent rods are called by the box around their bend; at double, nothing fills it.
inline constexpr double kFillsItsBox = 0.45;
/// Width over thickness below which there is a warning. Origin: what the method is meant for. At half nobody is warned; at double a dozen
/// of the corpus that bind are.
inline constexpr double kStout = 3;

/// Thicknesses: what is narrower may be at fault where a body does not bind, and is named then. Half and double change no verdict.
inline constexpr double kNarrow = 1.5;
/// Thicknesses, and the share of the area that may be narrower: more is a rod with a head. Origin: teeth of a comb 1.25 times as wide as thick are
/// cut as a sheet is. Half and double of the first change no verdict. At half of the share a stout slab is refused, of which 0.21 are narrow; at
/// double nothing changes, as what is so narrow is too stout as well.
inline constexpr double kTooNarrow = 1.1, kNarrowShare = 0.3;

/// Root of half the area over the mean thickness: a body without two sides that has more is a strip with half a twist. Origin: a ball has 3.8, a
/// cube 5.2. At half a cigar is called one-sided, as such a strip is; at double nothing changes.
inline constexpr double kSheetLike = 10;

/// Volume of the mid-surface times the thickness, over the body's. Origin: thin bodies have 0.96 to 1.17. Half and double the distance from 1
/// change no verdict: what is no sheet is refused for its sides, forks or width already.
inline constexpr double kLeastVolume = 0.8, kMostVolume = 1.2;

/// Length of the border of a hole, in mean thicknesses, below which a warning calls it a fault of the scan. Origin: such holes rarely bind. At half
/// none of the corpus is told apart; at double four bolt holes of a spacer and one of a dome are warned of, and both bind.
inline constexpr double kPinhole = 2;

// --- Tries ---

/// How often a mesh with something bad in it is made, and how many times as many triangles the next has. The corpus passes with two
/// and with eight, with 1.15 and with 1.6: few bodies need a second try.
inline constexpr int kTries = 4;
inline constexpr double kMore = 1.3;

/// Triangles of the sample that tells whether a surface passes through itself all over. Origin: so many know the mean of a scrambled surface to
/// some hundredths, in 20 ms. Half and double tell the same surfaces apart.
inline constexpr std::size_t kCrossingSample = 512;

/// Others that a triangle of such a surface passes through on the mean, neighbours left out. Origin: a fine sheet whose noise is five edges high
/// has 16 and binds; with six edges it has 24 and no two sides. Shuffled vertices make hundreds. At half the first one is refused. At double
/// one of 34 is searched for rays that mean nothing, for some seconds.
inline constexpr std::size_t kAllOver = 20;

/// Pairs of triangles that pass through each other, and pairs whose boxes touch, at which the search for self-intersections ends. Origin: half a
/// second; 300,000 even triangles have 2.6 million boxes that touch. At half both are still met by no sound body of the corpus; at double a
/// refusal takes half a second longer.
inline constexpr std::size_t kMostCrossings = 250000, kMostCrossingTests = 7500000;

}  // namespace kerf::mid
