// A picture of a session as it stands.
#pragma once

#include <filesystem>

#include "kerf/base/result.h"
#include "kerf/session/session.h"

namespace kerf::app {

/// Draws the body with the scene's camera and writes a PNG; with output.wireframe, the edges of the three meshes too
/// (visual black, collision orange, hexahedra in colours per copy), as in the paper's figures.
Status write_picture(Session& session, const Scene& scene, const std::filesystem::path& file);

}  // namespace kerf::app
