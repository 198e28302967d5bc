// What lies opposite: for every face of the working mesh the face that a ray into the body meets, and how sure it is
// that the two belong to the two sides of a thin body.
#pragma once

#include "kerf/base/progress.h"
#include "kerf/midsurface/surface_mesh.h"
#include "kerf/spatial/bvh.h"

namespace kerf::mid {

struct Pair {
  std::int32_t face = -1;               ///< opposite; -1: the ray met nothing
  std::array<double, 3> barycentric{};  ///< of the hit in it
  double distance = 0;                  ///< metres
  double confidence = 0;                ///< 0 to 1
};

struct Pairing {
  Column<Vec3> normal;         ///< |F|, unit, smoothed but not across creases
  Column<Pair> pair;           ///< |F|
  Column<double> of_facet;     ///< |F|: how sure the facet is (what creases bound) where it is one side, else 0
  double mean_confidence = 0;  ///< over the area
};

/// confidence = max(0, -n . n')^2 rho^3, rho = distance of the ray's middle to the surface over half its length: 1 where
/// that middle is on the medial surface, next to 0 for a face of the rim whose ray runs along the sheet. Faces of facets that are unsure as a
/// whole, the walls of a rim, have 0. One ray and one closest point for each face, in parallel. `progress` is asked between blocks of faces.
Result<Pairing> find_pairs(const SurfaceMesh& mesh, const TriangleBvh& bvh, double thickness,
                           const Progress& progress = {});

}  // namespace kerf::mid
