// The lattice's tolerances, each with its unit and reason.
#pragma once

namespace kerf {

/// Share of a cell's volume that a prism must fill to count as being in it. Rounding only: anything larger cuts
/// material off from its neighbours and makes false pieces.
inline constexpr double kOverlapVolume = 1e-12;

/// Share of the body. What the copies hold may differ from the body by this and one rounding for each piece of the triangle with the most
/// pieces. A prism and its parts in cells round some hundred times; a sum over all copies does not count, as it is a LongSum.
/// Lattices of a hundred million cells would fail at 1e-8, as a missing cell is as much.
inline constexpr double kVolumeRounding = 1e-12;

/// Share of a cell. A body fills at least this. A prism of kOverlapVolume / kLeastFill = 1e-9 of the body then still counts as being in its cell.
/// Slivers of cuts are larger (measured: a dozen cuts across a sheet lose some at a fill of 1e-6, and none at 1e-5).
inline constexpr double kLeastFill = 1e-3;

/// Cells. Corners of prisms nearer than this to a lattice plane are put onto it, so that bodies whose sides lie in
/// lattice planes leave no slivers in the cells behind.
inline constexpr double kPlaneSnap = 1e-10;

/// Cells, and cosine of a tip's plane to the prism. Corners of an upright prism lie this near to one another across and along it: rounding. Half or double is
/// rounding too. At zero, prisms that stand off by rounding have the same moments, for more work.
inline constexpr double kUprightPrism = 1e-12;

/// Cells. A wall between two prisms meets a cell, or lies in a cell's face, up to this distance.
inline constexpr double kWallReach = 1e-6;

/// Share of a cell. Copies with less material are absorbed by a neighbour: they ruin the conditioning and drop out of
/// the bending stiffness anyway (measured: 5 % is safe, 20 % makes a sheet visibly softer).
inline constexpr double kAbsorbedFill = 0.05;

/// Share of a cell. Copies with at least this much material count as full and share one element matrix.
inline constexpr double kFullFill = 1 - 1e-9;

/// Share of the tip's cell that the tip must have passed before the cell is split: the glue would be stiffer than
/// what it glues.
inline constexpr double kTipWelded = 0.02;

/// Cells. How far back along its lip the direction of a slit at its tip is taken, at most kTipLookBack vertices, and the least
/// cosine that a bit of the lip on the way may turn by.
inline constexpr double kTipReach = 0.25, kTipSameWay = 0.5;
inline constexpr int kTipLookBack = 16;

/// Stiffness of the glue at a tip over E h (1 - s) / s, fitted to the compliance of notched plates.
inline constexpr double kTipGlue = 0.2;

/// Sine of the angle between two border edges at a vertex below which they are the two lips of one slit.
inline constexpr double kTipAngle = 1e-7;

/// Sine of the angle below which a tip's continuation runs along an edge instead of through a triangle.
inline constexpr double kAlongEdge = 1e-6;

/// Nearest that a tip's continuation comes to the end of an edge that it crosses, as a share of the edge.
inline constexpr double kCrossingMargin = 1e-3;

}  // namespace kerf
