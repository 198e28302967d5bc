// All bodies of a scene as one: each is loaded and bound by itself, moved to its place and joined with the others.
#pragma once

#include <string>
#include <vector>

#include "kerf/base/progress.h"
#include "kerf/base/result.h"
#include "kerf/lattice/lattice_build.h"
#include "kerf/scene/scene.h"
#include "kerf/scene/scene_body.h"
#include "kerf/session/lattice_memory.h"

namespace kerf {

struct SceneBodies {
  CellComplex complex;                       ///< of all of them, at their places
  std::vector<LatticeBody> bodies;           ///< where each begins, its volume and its cells
  std::vector<BodyMemory> memory;            ///< what the cells of each will take
  std::vector<SceneBodyMaterial> materials;  ///< of each, complete
  std::vector<std::string> notes;            ///< repairs and warnings, one sentence each
};

/// How messages call the body of this number, from 0: by its name, or "body 2 (steak)".
std::string body_name(const Scene& scene, std::size_t number);

/// Bad input: a scene that says nothing but this body refuses it. It has no lattice, or lies too far off for its cells.
Status check_alone(const SceneBodyLoaded& loaded);

/// Bad input: what load_scene_body and scene_lattice refuse; closed bodies beside open sheets; models or cells that would take more
/// than memory_limit(), all bodies together.
///
/// Each body has the cells that it would have alone: at the origin, moved along with it; where [lattice] says how large they are
/// or where they lie, around the body at its place.
Result<SceneBodies> load_scene_bodies(const Scene& scene, const Progress& progress = {});

}  // namespace kerf
