// Where every visual vertex lies in the plane of its collision triangle (4.1.4): arc length along the sides, Floater's mean value
// coordinates (Floater 2003, the paper's [35]) inside.
#pragma once

#include <vector>

#include "kerf/base/progress.h"
#include "kerf/base/result.h"
#include "kerf/binding/patches.h"

namespace kerf {

struct Parametrization {
  std::vector<Vec2> planar;  ///< 3 |F visual| corners; the - side mirrored (y -> -y)
  int upright_patches =
      0;  ///< patches that needed the weights of the real positions, because those of squashed ones turned a triangle over
  int uniform_patches = 0;  ///< patches that needed uniform weights, because those turned one over too
};

/// One small sparse system per patch, in parallel, with the same bits for any number of threads. Every planar triangle is positively
/// oriented, exactly. All corners of one vertex in one plane hold the same bits; chain vertices are interpolated between
/// the corners of the collision triangle, bound vertices hold its corners' bits. Fails, naming the collision triangle,
/// where even uniform weights give no valid map (triangles too thin for double precision).
/// `planar`: memory for the result, of any contents.
Result<Parametrization> parametrize(const SplitSurface& surface, const CollisionMesh& collision,
                                    const BoundVertices& vertices, const PathNetwork& network, const PatchMap& patches,
                                    bool closed, std::vector<Vec2> planar, const Progress& progress);

}  // namespace kerf
