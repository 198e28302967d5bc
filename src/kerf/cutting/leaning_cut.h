// How far the lips of a cut lie beside what its blade swept.
#pragma once

#include <span>

#include "kerf/base/vec.h"

namespace kerf {

struct BladeArc;
struct CollisionMesh;

/// The lips of a cut lie beside what its blade swept where the blade leans: walls stand square on the mid-surface.
//      blade \   |  wall
//   skin _____\__|____
//              \ |     distance: half the thickness x the lean's tangent
//   - - - - - - \x - -  mid-surface
struct LeaningCut {
  double distance = 0;   ///< metres, the most
  double thickness = 0;  ///< metres, there
  Vec3 at;               ///< there, at rest
};

/// That of the parts of an arc that a blade sweeps, where they are more than `most`. Faces that lie along it have none. `along`: unit, the blade. `position`: metres, a vertex.
void find_leaning(const CollisionMesh& mesh, std::span<const Vec3> position, const BladeArc& arc, Vec3 along,
                  LeaningCut& most);

}  // namespace kerf
