// Corners and convex edges of the parts of rigid shapes: what pokes into coarse triangles between their vertices.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kerf/contact/rigid_shape.h"

namespace kerf {

/// A corner (or centre, or end) with a ball around it, in the world.
struct ShapePoint {
  Vec3 p;
  Vec3 outward;       ///< unit, out of the part; zero: there is no inside to point out of
  double radius = 0;  ///< m
  std::int32_t id = 0;
};
/// A convex edge (or axis) with a tube around it.
struct ShapeEdge {
  Vec3 a, b;
  Vec3 outward;              ///< unit; zero: no inside
  std::array<Vec3, 2> into;  ///< unit, from the edge into its faces; zero: no such face
  double radius = 0;         ///< m
  std::int32_t id = 0;
};
struct ShapeFeatures {
  std::vector<ShapePoint> points;
  std::vector<ShapeEdge> edges;
  void clear() {
    points.clear();
    edges.clear();
  }
};

/// All features of a sphere, capsule or box; a plane has none. Those of a mesh are asked for one by one.
void all_features(const PlacedPart& part, ShapeFeatures& features);
/// Vertex v or packed edge of a mesh part.
ShapePoint mesh_point(const PlacedPart& part, std::int32_t v);
ShapeEdge mesh_edge(const PlacedPart& part, const ObstacleLeaves::Edge& edge);

}  // namespace kerf
