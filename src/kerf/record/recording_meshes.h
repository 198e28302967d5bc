// Mesh files that travel in a recording, on their way back to disk. Private to recordings.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "kerf/record/recording.h"
#include "kerf/scene/scene_file.h"

namespace kerf {

/// What recordings know the bytes of a mesh file by, and saved sessions their own.
std::uint64_t bytes_hash(std::string_view bytes);
/// Writes the meshes that a recording carries into this folder, and says where the scene finds them.
Result<SceneFolders> unpack_meshes(const SceneSource& source, const std::filesystem::path& folder);
/// Bad input: a mesh of the scene has not the bytes that were recorded.
Status check_meshes(const Scene& scene, const SceneSource& source);

}  // namespace kerf
