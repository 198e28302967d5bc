// All bodies of a scene as one: each is loaded and bound by itself, moved to its place and joined with the others.
#pragma once

#include <string>
#include <vector>

#include "kerf/base/progress.h"
#include "kerf/base/result.h"
#include "kerf/lattice/lattice_build.h"
#include "kerf/scene/scene.h"

namespace kerf {

struct SceneBodies {
  CellComplex complex;                       ///< of all of them, at their places
  LatticeFrame frame;                        ///< one lattice for all
  std::vector<LatticeBody> bodies;           ///< where each begins, and its volume
  std::vector<SceneBodyMaterial> materials;  ///< of each, complete
  std::vector<std::string> notes;            ///< repairs and warnings, one sentence each
};

/// How messages call the body of this number, from 0: by its name, or "body 2 (steak)".
std::string body_name(const Scene& scene, std::size_t number);

/// Bad input: what load_scene_body and scene_lattice refuse; closed bodies beside open sheets; a lattice that would take more than
/// memory_limit().
///
/// The lattice of one body is the one that it would have at the origin, moved along. Several share one: that of the first
/// body, with the least cell of all along each axis, enlarged to hold them all. The notes say when a body gets cells much
/// finer than it would have alone.
Result<SceneBodies> load_scene_bodies(const Scene& scene, const Progress& progress = {});

}  // namespace kerf
