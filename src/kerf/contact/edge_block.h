// Corners and convex edges of a mesh near a leaf of a body, eight at a time and in single precision: what cannot touch the
// body's faces and edges is left out before anything is computed exactly. Nothing that can touch is.
#pragma once

#include <array>
#include <cstdint>

#include "kerf/base/eight.h"
#include "kerf/base/vec.h"
#include "kerf/contact/obstacle_mesh.h"

namespace kerf {

/// Eight corners, and eight edges. Places are from a common centre, so that they are small numbers; unused ones, at the end, are far away.
struct PointBlock {
  Eight p[3];                          ///< m
  std::array<std::int32_t, 8> vertex;  ///< of the mesh
};
struct EdgeBlock {
  Eight a[3], b[3];                   ///< ends, m
  Eight length;                       ///< m
  Eight into[2][3], at[2];            ///< into the edge's faces; and where it lies along these, m
  std::array<std::uint32_t, 8> edge;  ///< places in ObstacleLeaves::edges
};
/// Nothing but unused lanes.
PointBlock empty_points();
EdgeBlock empty_edges();
/// Fills lane `i`.
void set_point(Vec3 p, std::int32_t vertex, Vec3 centre, std::size_t i, PointBlock& block);
void set_edge(const ObstacleLeaves::Edge& edge, std::uint32_t place, Vec3 centre, std::size_t i, EdgeBlock& block);

/// The body's edge that blocks are asked about, all in the frame of the mesh.
struct EdgeProbe {
  TreeCorner a, b;                   ///< ends, from the centre, m
  std::array<TreeCorner, 2> into{};  ///< unit, into its faces; zero: none
  std::array<float, 2> at{};         ///< where it lies along these, m
  float reach = 0, length = 0;       ///< m
  float extent = 0;                  ///< no coordinate of anything asked about is larger, m: rounding is measured by it
};
/// Bit i: point i comes within `reach` of a box (from the centre as well).
unsigned near_box(const PointBlock& block, const TreeBox& box, float reach);
/// Bit i: edge i of the block may come within reach, inside both edges, in a direction that is off the faces of both
/// (BodyView::off_faces, for either sign).
unsigned may_touch(const EdgeBlock& block, const EdgeProbe& probe);

}  // namespace kerf
