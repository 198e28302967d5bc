// A rigid triangle mesh to collide with (a bone, a hook): everything that does not depend on its pose, prepared once.
//
// A closed mesh has an inside: normals point out of it however deep a point lies. An open one is two-sided.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/base/vec.h"
#include "kerf/contact/surface_tree.h"
#include "kerf/mesh/triangle_mesh.h"
#include "kerf/spatial/bvh.h"
#include "kerf/spatial/triangle_view.h"

namespace kerf {

/// What stands in one leaf of an obstacle's tree, side by side in memory.
struct ObstacleLeaves {
  struct Triangle {
    TreeBox box;
    std::array<Vec3, 3> corner;
    std::int32_t id;
  };
  struct Edge {
    TreeBox box;
    Vec3 a, b;
    std::array<Vec3, 2> into;  ///< unit, from the edge into its faces; zero: none
    std::int32_t half_edge;
    float length;  ///< m, rounded up
  };
  std::vector<Triangle> triangles;
  std::vector<Edge> edges;             ///< convex ones
  std::vector<std::int32_t> vertices;  ///< of convex edges
  std::vector<TreeBox> box;            ///< per node of the tree
  /// Per node of the tree; only leaves have any.
  struct Range {
    std::uint32_t triangle, triangle_end, edge, edge_end, vertex, vertex_end;
  };
  std::vector<Range> range;
};

struct ObstacleMesh {
  std::vector<Vec3> positions;             ///< |V|, metres, in its own frame
  std::vector<std::int32_t> corners;       ///< 3 |F|
  std::vector<Vec3> face_normal;           ///< |F|, unit; of a triangle without area that of its surroundings
  std::vector<Vec3> edge_normal;           ///< 3 |F|, unit: half-way between the normals of the edge's faces
  std::vector<Vec3> vertex_normal;         ///< |V|, unit, weighted by angles
  std::vector<std::int32_t> twin;          ///< 3 |F|, the other half-edge of a proper inner edge, or -1
  std::vector<std::uint8_t> convex_edge;   ///< 3 |F|, 1: a convex edge or a border, and this half-edge stands for it
  std::vector<std::int32_t> vertex_owner;  ///< |V|, the half-edge that stands for a vertex of a convex edge; else -1
  TriangleBvh tree;
  ObstacleLeaves leaves;
  Box3 box;
  bool closed = false;

  [[nodiscard]] TriangleView view() const { return {positions, std::span<const std::int32_t>(corners)}; }
  [[nodiscard]] std::size_t triangle_count() const { return corners.size() / 3; }
};

/// Edges bent by less than this (radians, 3 degrees) count as flat: their faces and vertices do.
inline constexpr double kFlatEdge = 0.0524;

/// Prepares a mesh. Needs no manifold; it is closed if every edge has just two triangles, in opposite directions.
/// Bad input: no triangles, corners out of range or repeated in a triangle, positions that are not finite. O(n log n).
Result<ObstacleMesh> make_obstacle_mesh(const TriangleMesh& mesh);

}  // namespace kerf
