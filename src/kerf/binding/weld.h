// Topology needs one vertex per place: files split vertices along texture seams.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/mesh/triangle_mesh.h"

namespace kerf {

struct WeldedSurface {
  std::vector<Vec3> positions;
  std::vector<std::array<std::int32_t, 3>> triangles;
  std::vector<std::int32_t> original;  ///< |V welded|: the first vertex of the input at this place
  std::size_t merged = 0;              ///< input vertices that share a place with an earlier one
  std::size_t unused = 0;              ///< input vertices without a triangle, left out
  std::size_t apart = 0;               ///< vertices that share a place with an earlier one and were kept
};

/// Drops unused vertices, and with `merge` those at exactly equal positions; ids stay as they are when there are none of either.
/// Linear time. Bad input, naming vertex or triangle (1-based, of the input) after `name` ("visual mesh"): no triangles,
/// indices out of range, coordinates that are not finite, a triangle without area, duplicate triangles, more than kMostAround
/// triangles at one vertex.
Result<WeldedSurface> weld(const TriangleMesh& mesh, std::string_view name, bool merge = true);

}  // namespace kerf
