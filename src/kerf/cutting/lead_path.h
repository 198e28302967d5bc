// Straight over the collision mesh at rest, from one place of the material to another nearby: how ends and beginnings of a blade's path are led to
// where they belong.
#pragma once

#include <vector>

#include "kerf/cutting/blade_arcs.h"

namespace kerf {

/// A place of the material: a point of `face`, or, without one, the vertex `corner` with all faces around it. `at`: at rest, metres.
struct PathPlace {
  Vec3 at;
  CollisionTriangle face;
  CollisionVertex corner;
};

/// The edges that the straight way from a place to another crosses, in order; borders are not crossed. Where no way is straight, the one whose edges come
/// nearest to the segment, all of them within `reach` (metres). Straight is what is straight when the faces are laid into the plane of the first.
/// False: no such way within a few faces; `way` is empty then. Cost: the faces near the segment. Allocates only if `way` has to grow.
bool lead_path(const CollisionMesh& mesh, const PathPlace& from, const PathPlace& to, double reach,
               std::vector<ArcCrossing>& way);

}  // namespace kerf
