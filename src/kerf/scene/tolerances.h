// Numbers that decide how a scene's body is bound and what is said of it.
#pragma once

namespace kerf {

/// So often a collision mesh is made of an open sheet, each with twice the triangles of the last. At half (1) sheets with fine bends are refused whose
/// second mesh binds; at double a sheet that never binds takes 32 times the triangles of the first.
inline constexpr int kTriesOfSheet = 3;

/// Edges of the collision mesh: a fold of the sheet that is longer is refused before a mesh is made. Ridges of 0.5 to 2 edges in a cloth bind. At half
/// those from 1 on are refused; at double longer ones cost a mesh first.
inline constexpr double kLongFold = 2;
/// Edges of the collision mesh: a fold this near to where it does not bind is at fault. A path or a patch that fails spans one edge or two. At half folds
/// at its ends are missed, and more meshes are tried in vain; at double folds two triangles away are called at fault.
inline constexpr double kFaultReach = 2;

/// Of the edges, on a border: a surface with no more may be a closed body with a hole. A disc of 10,000 triangles has 0.02. At half a closed body of
/// 456 edges is told of one missing triangle and not of two; at double kRoundBorder decides alone, up to 625 edges.
inline constexpr double kFewOpenEdges = 0.02;
/// Border edges squared over edges: a surface with less is such a body. A square of n x n has 5, a disc 8, a bag whose opening is as wide as it is deep
/// 2. At half a body of 456 edges is not told of a hole of 16; at double such a bag is on the edge.
inline constexpr double kRoundBorder = 1;

/// Bytes of bound models that a process keeps: the eleven models as they come take 14 MB. Half keeps them too. Double: nothing but memory.
inline constexpr std::size_t kMostKeptModels = 64 << 20;

}  // namespace kerf
