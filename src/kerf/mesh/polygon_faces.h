// Faces of mesh files that have more than three corners. A fan from the first corner covers a convex face. Other faces are cut into ears: triangles
// of three neighbouring corners that hold no other corner.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "kerf/base/vec.h"
#include "kerf/mesh/triangle_mesh.h"

namespace kerf {

/// Where a face stands in a mesh: its triangles are a fan from its first corner.
struct PolygonFace {
  std::size_t first = 0;    ///< triangle
  std::size_t corners = 0;  ///< of the face, 3 or more
  std::size_t place = 0;    ///< the reader's: a line, or a number of the face
};

struct PolygonTriangles {
  std::vector<std::array<std::int32_t, 3>>
      corners;            ///< numbers of the polygon's corners; none: it has no ears, so it is not simple
  bool too_long = false;  ///< given up: ears were looked for too long (kMostEarTests)
};

/// Divides a simple polygon, flat or nearly so, into `corners.size() - 2` triangles that turn as it does: a fan from its first corner if that
/// covers it once, else ears. Cost: linear for a fan; for ears what lies beside them, n^2 at most.
PolygonTriangles triangulate_polygon(std::span<const Vec3> corners);

/// Gives every face whose fan does not cover it once other triangles in their place; one that is not simple keeps its fan. The first that took too long, or null.
const PolygonFace* fit_polygon_faces(std::span<const PolygonFace> faces, TriangleMesh& mesh);

/// What to say of a face that took too long.
std::string too_many_corners(const PolygonFace& face);

}  // namespace kerf
