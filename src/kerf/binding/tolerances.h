// Tolerances of pre-processing (4.1), all dimensionless. Decisions about topology are combinatorial: none of these can
// break a mesh, they only keep triangles fat.
#pragma once

namespace kerf {

/// A path or a bound point nearer than this fraction of the local edge to a free vertex uses that vertex. 0.1 %, 1 %, 5 %
/// and 10 % gave smallest angles of 0.002, 0.1, 0.1 and 0.7 degrees; more would bend paths visibly.
inline constexpr double kSnapFraction = 0.05;

/// Visual edges longer than this many mean collision edges are halved first; at most this many faces for each collision triangle come of it.
inline constexpr double kLongEdge = 3, kMostByHalving = 64;

/// Flat parts with thin triangles that have inner edges longer than this many mean collision edges are triangulated anew. At 1 short
/// fans stay, whose spokes every path crosses; at 0.25 the sides of plates are looked at for nothing.
inline constexpr double kLongSpoke = 0.5;

/// A triangle lower than this part of its longest edge is thin. At 0.3 graded grids are triangulated anew, at 0.07 short fans are not.
inline constexpr double kThinHeight = 0.15;

/// Points off a plane by less than this part of the longest edge lie in it: float coordinates do, turned in space. At 1e-8 those of files do not; at 1e-5
/// fine meshes of gently bent surfaces would be flattened.
inline constexpr double kFlatOff = 1e-7;

/// Texture coordinates off one affine map by less than this belong to it: a hundredth of a pixel of a large picture.
inline constexpr double kFlatTexture = 1e-5;

/// The sum of two cotangents must be below minus this for a flip: more than rounding, or corners of a circle would flip for ever.
inline constexpr double kDelaunayGain = 1e-9;

/// A path crosses an edge at least this fraction away from an end that lies on a wall or border, so that paths that run
/// side by side do not shrink edges geometrically.
inline constexpr double kWallMargin = 0.3;

/// Neither moves a point by more than this part of the mean collision edge, so that collision edges stay where they are drawn. The plate's mean
/// displacement is 0.13 % of an edge without it, 0.042 % at 0.01, 0.023 % at 0.005, 0.014 % at 0.002; smaller leaves thinner triangles.
inline constexpr double kMostShift = 0.005;

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

/// A shortest rim path that rises above the mid-surface by more than this fraction of the half thickness leaves the rim.
inline constexpr double kRimHeight = 0.5;

/// A path that follows the rim may be this much longer than the shortest one.
inline constexpr double kRimDetour = 1.5;
/// A path longer than this many times its edge winds around others: more would follow, each longer than the last.
inline constexpr double kWinding = 30;

/// A border vertex is led to its bound point if that is nearer than this part of its shortest edge. Given collision meshes end 0.1 to 0.18
/// short of the rim; at 0.2 some stay behind, at 0.8 triangles of the border are stretched to twice their width.
inline constexpr double kLeadReach = 0.4;

/// Leading may not shrink a triangle's area, seen along its normal, below this part, nor turn it by more than this cosine: at half the part slivers
/// remain that paths wind around, at the double (0.4) corners of coarse discs stay behind.
inline constexpr double kLeadShrink = 0.2, kLeadTurnCosine = 0.5;

/// Vertices led farther than this part of their shortest edge are counted in the report. Only the count depends on it.
inline constexpr double kLedNoticeably = 0.01;

/// Faces whose normal has a smaller cosine to the mid-surface's are the side of a body, at its rim. 45 degrees: at 0.35 bevels are no side, at 1
/// the top is.
inline constexpr double kSteepCosine = 0.7;

/// The side's direction at a border vertex is taken within this many half thicknesses. At half, scans follow their noise (0.075 edge of displacement
/// where it was 0.059); at double, corners turn the corner.
inline constexpr double kSideReach = 0.8;

/// Normals of border vertices lean by at most this sine: 37 degrees. At half, bevelled rims keep a displacement; at double, prisms fold over.
inline constexpr double kMostLean = 0.6;

/// What is left of the height above the mid-surface when paths and parameters are found. 0.01 made a strip of 1.2 % of a plate's width 4 % too
/// wide, 0.003 3 %; 0.001 1 to 2 %, and 0.0003 the same. 0 would flatten steep faces to nothing.
inline constexpr double kSquash = 0.001;

/// Newton's method in a prism ends at this part of the triangle's size, or after so many steps: 1 where normals are parallel, 3 to 4 where
/// they are bent. At 1e-8 neighbours in two prisms would differ visibly to exact predicates; at 1e-14 it would not end.
inline constexpr double kNewtonExact = 1e-12;
inline constexpr int kMostNewtonSteps = 8;

/// A prism's cross-section below this part of its triangle means that its normals cross there. At 0.1 thick bent bodies lose prisms, at 0.025 points near
/// the crossing are thrown far.
inline constexpr double kLeastPrismArea = 0.05;

/// A vertex tries at most so many prisms: it starts in a neighbour's, so 2 or 3 are usual; 12 end some walks of fine collision meshes early.
inline constexpr int kMostPrisms = 24;

/// Displacement is measured on faces whose normal has a larger cosine to the mid-surface's. Only the figure depends on it.
inline constexpr double kDrawnCosine = 0.5;

/// A mean displacement above this part of the mean collision edge is warned of: walls are drawn visibly beside the blade. At half, rough collision
/// meshes finer than the body is thick are warned of too (0.07); at double, nothing was seen to be.
inline constexpr double kMuchDisplaced = 0.1;

}  // namespace kerf
