// Where a surface passes through itself.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "kerf/mesh/triangle_mesh.h"

namespace kerf {

struct SelfIntersections {
  std::size_t pairs = 0;  ///< of triangles that pass through each other
  double deepest =
      0;  ///< metres: of a pair, the least of how far each reaches past the other's plane and how long the line is along which they meet
  std::array<std::int32_t, 2> deepest_pair{-1, -1};  ///< the two triangles
  std::vector<Vec3> places;                          ///< of the first ones, a point near each
  std::vector<std::int32_t> triangles;               ///< that take part, rising, each once
};

/// Of triangles that share a corner: a surface that was given is judged without them, as its needles cross their neighbours often.
enum class Neighbours { kLeaveOut, kCount };

/// Exact; pairs that lie in one plane or only touch at a corner are not counted. About n log n, in parallel.
SelfIntersections find_self_intersections(const TriangleMesh& mesh, Neighbours neighbours = Neighbours::kLeaveOut);

}  // namespace kerf
