// Numbers that decide which overlap beside a cut is none (allowed_overlap.cpp), and where a body gets points besides its collision vertices (side_points.cpp).
#pragma once

namespace kerf {

/// Half thicknesses of both: places that are new to each other as a cut is made, and nearer than this at rest, have not slid along each other. At a quarter,
/// twisted walls that bulge into each other are allowed to (Lips.TwistedWalls...). At half and double no test differs.
inline constexpr double kNearAtRest = 1;

/// Half thicknesses that a contact beside a cut gets deeper than its step has left it, at most: what turns does so by less. At half and double no test differs.
/// At four times, pieces of combs and polylines that are cut in a hanging plate are up to 1.8 times as fast.
inline constexpr double kJump = 0.01;

/// Cells: faces that are larger on the average, as even-sided triangles of their area, have points between their corners. Up to there a squeezed body is too
/// soft by a tenth at most. At 1.25 the paper's sheet of 104 triangles and 81 cells would have points; at double a slab with edges of two cells gives a twelfth of its force.
inline constexpr double kLargeFaces = 1.5;
/// Cells that these lie apart at most, and ends of an edge that it has in its middle. Bodies of several layers have them from this size on. At half there are four times as
/// many, and nothing is held better; at double every other node is free.
inline constexpr double kSideApart = 1.1, kSideLongest = 1.75;
/// Cells: bodies that are thicker on the average have the corners of their prisms in other cells than their mid-surface. Lattices chosen with one layer are at 1 at most, with two
/// at 2; at 1 cells of a body that leans would change places of built-in models, at double half of two layers is free.
inline constexpr double kThickBody = 1.25;
/// Pieces that an edge is divided into, at most.
inline constexpr double kMostSidePieces = 32;
/// Cosine between a side's normal and the way into what it newly meets, at least.
inline constexpr double kFacing = 0.2;
/// Steps to the place of a piece of a side that is nearest to a shape; normals that differ by less (1 - cosine) are those of a plane; half thicknesses that it is
/// nearer than the piece's corners, at least.
inline constexpr int kSideSteps = 5;
inline constexpr double kSameNormal = 1e-6, kSideNearer = 2e-3;

}  // namespace kerf
