// Numbers that decide how fine a collision mesh is, and which surfaces none is made of.
#pragma once

#include <cstddef>

namespace kerf::mid {

/// Triangles of a collision mesh whose bends ask for fewer. Origin: the paper's models have 67 to 137. At half of it a flat sheet has half as many; at
/// double a mesh no longer depends on the shape alone (Midsurface.FineAndCoarseInputsAgree).
inline constexpr double kDefaultTriangles = 160;

/// Triangles that bends may ask for by themselves; a sheet with no more is its own collision mesh. Origin: cutting and contact cost a share
/// for each of them. The corpus of thin bodies passes its tests with half and with double.
inline constexpr double kMostByNeed = 1500;

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

/// Pairs of triangles that pass through each other, and pairs whose boxes touch, at which the search for self-intersections ends. Origin: a
/// second; 300,000 even triangles have 2.6 million boxes that touch. At half both are still met by no sound body of the corpus; at double a
/// refusal takes a second longer.
inline constexpr std::size_t kMostCrossings = 500000, kMostCrossingTests = 15000000;

}  // namespace kerf::mid
