// Numbers that decide how fine a collision mesh is.
#pragma once

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

}  // namespace kerf::mid
