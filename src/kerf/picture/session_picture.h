// A picture of a session as it stands.
#pragma once

#include "kerf/base/result.h"
#include "kerf/picture/picture.h"
#include "kerf/scene/scene.h"
#include "kerf/session/session.h"

namespace kerf {

/// Draws body, obstacles and tools with this camera and size; with output.wireframe, the edges of the three meshes too (visual black, collision
/// orange, hexahedra in colours per copy), as in the paper's figures. Bad input: meshes of the scene's shapes can't be read.
Result<Picture> draw_session(Session& session, const SceneOutput& output);

}  // namespace kerf
