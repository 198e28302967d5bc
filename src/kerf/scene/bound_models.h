// Bodies of models, bound once a process: a second session of a model copies what the first one bound.
#pragma once

#include <cstddef>

#include "kerf/base/progress.h"
#include "kerf/base/result.h"
#include "kerf/scene/scene_body.h"

namespace kerf {

/// The body of a model (SceneBody::model), from load_scene_body or from an earlier call that asked for the same. From any thread. Bad input and
/// failures, which are not kept: as load_scene_body. Models take kMostKeptModels bytes at most; those asked for longest ago go first.
Result<SceneBodyLoaded> bound_model(const SceneBody& body, const Progress& progress = {});

/// Bytes of models that are kept, for tests.
std::size_t kept_model_bytes();

}  // namespace kerf
