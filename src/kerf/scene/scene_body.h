// From the [body] of a scene to a bound body: generate or read, scale, check, bind.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "kerf/base/progress.h"
#include "kerf/base/result.h"
#include "kerf/binding/bind.h"
#include "kerf/binding/bound_body_file.h"
#include "kerf/mesh/models.h"
#include "kerf/midsurface/midsurface.h"
#include "kerf/scene/body_nature.h"
#include "kerf/scene/scene.h"

namespace kerf {

struct SceneBodyLoaded {
  BoundBody bound;
  std::optional<LatticeHint> lattice;  ///< of a model, or a body bound from one: the lattice it recommends
  double young = kSceneYoung;          ///< pascals; the model's own, that of a bound body, or the default
  double poisson = kScenePoisson;
  double density = kSceneDensity;  ///< kg/m3
  std::vector<std::string> notes;  ///< repairs and warnings, one sentence each
};

/// Surfaces that a program has: taken where the body names files, whose names then stand for them in messages.
struct SurfacesInMemory {
  std::optional<TriangleMesh> visual, collision;
};

/// Makes or reads the body and binds it, or loads a bound one. Bad input, naming file and element: whatever
/// make_model, read_mesh, check_surface, bind and load_bound_body refuse, an open visual mesh without a
/// thickness, and a closed one without collision mesh that is not thin. made: receives the automatic mid-surface, if one
/// was made, even when the body is refused.
Result<SceneBodyLoaded> load_scene_body(const SceneBody& body, const Progress& progress = {},
                                        std::optional<Midsurface>* made = nullptr, SurfacesInMemory given = {});

/// What a file of this body should keep of what it is made of: what a person said, else what its model knows of itself.
BodyNature nature_to_keep(const SceneBody& body, const SceneBodyLoaded& loaded, const BodyNature& said);
/// The body as it comes back from such a file.
SceneBodyLoaded with_nature(BoundBody bound, const BodyNature& nature);
/// The nature with which with_nature makes it again.
BodyNature nature_of(const SceneBodyLoaded& loaded);

}  // namespace kerf
