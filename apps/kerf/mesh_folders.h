// Where mesh files are looked for that a scene names and that are not in its own folder.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace kerf::app {

/// Those of --meshes, then those of KERF_MESHES (separated by colons), made absolute.
std::vector<std::filesystem::path> mesh_folders(const std::vector<std::string>& given);

/// Said of the option by every command that has it.
inline constexpr const char* kMeshesHelp =
    "Folder with mesh files that the scene names; several times: several. KERF_MESHES=FOLDER:FOLDER does the same";

}  // namespace kerf::app
