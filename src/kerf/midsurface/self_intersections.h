// Where a surface passes through itself.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "kerf/mesh/triangle_mesh.h"

namespace kerf {

struct SelfIntersections {
  std::size_t pairs = 0;         ///< of triangles that share no vertex and meet
  std::vector<Vec3> places;      ///< of the first ones, a point near each
  std::vector<std::int32_t> triangles;  ///< that take part, rising, each once
};

/// Exact; pairs that lie in one plane are not counted. About n log n, in parallel.
SelfIntersections find_self_intersections(const TriangleMesh& mesh);

}  // namespace kerf
