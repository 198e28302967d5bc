// Exact geodesic distances by CGAL's Surface_mesh_shortest_path, on the surface cut open along its walls.
#pragma once

#include <cstdint>
#include <vector>

#include "kerf/geodesic/walled_surface.h"

namespace kerf::test {

/// Corners of faces (half-edges, by their origin) that are one point once the surface is cut open along walls.
struct CutOpen {
  explicit CutOpen(const WalledSurface& m);
  std::vector<std::int32_t> vertex;  ///< 3 |F|: vertex of the cut mesh at the origin of every half-edge
  std::vector<Vec3> position;        ///< of the cut mesh
};

/// Distances from cut vertex s to all cut vertices, metres; negative where there is no way.
std::vector<double> exact_distances(const WalledSurface& m, const CutOpen& cut, std::int32_t s);
/// Those to a few cut vertices only.
std::vector<double> exact_distances_to(const WalledSurface& m, const CutOpen& cut, std::int32_t s,
                                       const std::vector<std::int32_t>& targets);

}  // namespace kerf::test
