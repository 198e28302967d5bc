// Where a surface passes through itself.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "kerf/base/progress.h"
#include "kerf/base/result.h"
#include "kerf/mesh/triangle_mesh.h"

namespace kerf {

struct SelfIntersections {
  std::size_t pairs = 0;  ///< of triangles that pass through each other
  double deepest =
      0;  ///< metres: of a pair, the least of how far each reaches past the other's plane and how long the line is along which they meet
  std::array<std::int32_t, 2> deepest_pair{-1, -1};  ///< the two triangles
  std::vector<Vec3> places;                          ///< of the first ones, a point near each
  std::vector<std::int32_t> triangles;               ///< that take part, rising, each once
  bool complete = true;  ///< false: a limit was met, and what is here is what was found by then
};

/// Of triangles that share a corner: a surface that was given is judged without them, as its needles cross their neighbours often.
enum class Neighbours { kLeaveOut, kCount };

/// How far a search goes. The same limits end it at the same triangle, however many threads there are.
struct SearchLimits {
  std::size_t pairs = SIZE_MAX;  ///< that pass through each other
  std::size_t tests = SIZE_MAX;  ///< pairs whose boxes touch: of scrambled or long triangles nearly all
  Progress progress = {};  ///< asked between blocks of triangles; where it asks to stop, the search ends with an error
};

/// What some triangles, evenly spread over the list, meet.
struct CrossingsSample {
  std::size_t crossings = 0;            ///< of theirs with others
  std::vector<Vec3> places;             ///< of the first ones, a point near each
  std::vector<std::int32_t> triangles;  ///< that take part, rising, each once
};

/// Exact; pairs that lie in one plane or only touch at a corner are not counted. About n log n, in parallel, in small blocks.
Result<SelfIntersections> find_self_intersections(const TriangleMesh& mesh, const SearchLimits& limits,
                                                  Neighbours neighbours = Neighbours::kLeaveOut);
/// The same without limits.
SelfIntersections find_self_intersections(const TriangleMesh& mesh, Neighbours neighbours = Neighbours::kLeaveOut);

/// Compares up to `count` triangles with all others but their neighbours, until a limit is met.
Result<CrossingsSample> sample_crossings(const TriangleMesh& mesh, std::size_t count, const SearchLimits& limits);

}  // namespace kerf
