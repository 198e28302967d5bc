// Tolerances of pre-processing (4.1), all dimensionless. Decisions about topology are combinatorial: none of these can
// break a mesh, they only keep triangles fat.
#pragma once

#include <cstddef>

namespace kerf {

/// A path or a bound point nearer than this fraction of the local edge to a free vertex uses that vertex. 0.1 %, 1 %, 5 %
/// and 10 % gave smallest angles of 0.002, 0.1, 0.1 and 0.7 degrees; more would bend paths visibly.
inline constexpr double kSnapFraction = 0.05;

/// Visual edges longer than this many mean collision edges are halved first; at most this many faces for each collision triangle come of it.
inline constexpr double kLongEdge = 3, kMostByHalving = 64;

/// Edges longer than this many mean collision edges beside a triangle lower than this part of the edge are taken out of flat parts. Spokes of
/// fans are; grids of squares and boxes of two triangles a side, which do no harm, are not.
inline constexpr double kLongInFlatPart = 1.5, kThinFan = 0.15;
/// Two triangles lie in one plane if corners are off it by no more than this part of their longest edge (far below what a float keeps of a turned
/// body), and in one texture map if that is off by no more than this (a texture has some thousand pixels; floats of 1 are good to 1e-7).
inline constexpr double kFlatPart = 1e-7, kSameTexture = 1e-5;
/// A flip must better the sum of two cotangents by more than rounding. So many a face are made at most: each betters the triangulation, but
/// near this bound rounding has made a circle.
inline constexpr double kDelaunayGain = 1e-9;
inline constexpr std::size_t kMostFlips = 64;

/// A path crosses an edge at least this fraction away from an end that lies on a wall or border, so that paths that run
/// side by side do not shrink edges geometrically.
inline constexpr double kWallMargin = 0.3;

/// A triangle with twice its area below this fraction of its longest edge squared counts as having no area.
inline constexpr double kZeroAreaFraction = 1e-12;

/// So often normals are made smoother where rays cross.
inline constexpr int kMostUncrossings = 12;

/// A ray hit farther away than this many times the typical half thickness around it belongs to another part of the body.
inline constexpr double kReachFactor = 4.0;

/// A collision vertex outside the body is still bound to the closest point up to this many typical half thicknesses away.
inline constexpr double kOutsideFactor = 2.0;

/// Two collision triangles that meet at an inner edge with normals whose cosine is below this fold the mesh over itself.
inline constexpr double kFoldCosine = -0.7;

/// A border vertex of the collision mesh no farther from the visual mesh than this part of the edges there is on its rim.
inline constexpr double kOnRim = 1e-3;
/// One that is off the rim by less than this part of its shortest edge is led out to it. Scans stop 0.1 to 0.18 short; half an edge would turn triangles over.
inline constexpr double kMostLead = 0.4;

/// A face whose normal has less than this cosine to the mid-surface's normal is part of the body's side.
inline constexpr double kSteep = 0.7;
/// Faces of the side count up to this many half thicknesses from the rim: the height of a side, without its neighbours' round a corner.
inline constexpr double kSideReach = 0.8;
/// Sine of the angle by which normals at the rim may lean: 37 degrees. More is no side that a prism could follow.
inline constexpr double kMostLean = 0.6;

/// A shortest rim path that rises above the mid-surface by more than this fraction of the half thickness leaves the rim.
inline constexpr double kRimHeight = 0.5;

/// Heights over the mid-surface count this much on the squashed surface. Rim strips of 1 % of a plate are off by 4 % with 0.01, 3 % with 0.003,
/// 1 to 2 % with 0.001 and below. A side takes so much of half a thickness off a rim triangle: far below the minimum feature of cuts.
inline constexpr double kSquash = 1e-3;
/// Newton steps to a place in a prism (one where normals are parallel, 3 or 4 where they turn), and the square of how near to it is near
/// enough, part of twice the triangle's area.
inline constexpr int kPrismSteps = 4;
inline constexpr double kPrismGoal = 1e-18;
/// Where a prism's cross-section has shrunk to this part of its triangle, normals are about to cross.
inline constexpr double kPrismLeast = 0.05;
/// Prisms that are tried for a vertex: it is in the one of the vertex before, or a few further on.
inline constexpr std::size_t kMostPrisms = 24;

/// A path that follows the rim may be this much longer than the shortest one.
inline constexpr double kRimDetour = 1.5;
/// A path longer than this many times its edge winds around others: more would follow, each longer than the last.
inline constexpr double kWinding = 30;

}  // namespace kerf
