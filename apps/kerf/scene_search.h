// Shipped scenes are found from any folder.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "kerf/base/result.h"

namespace kerf::app {

/// Folders that hold shipped scenes, in the order they are searched: those of the environment variable
/// KERF_SCENES (separated by colons), share/kerf/scenes beside the program's own folder; where that is none, the
/// source folder it was built from.
std::vector<std::filesystem::path> scene_folders();

/// The file for what a person typed: a path as it stands, else a scene of scene_folders(), each with and
/// without .toml. Bad input says how a model of this name is used, or lists where it looked and the shipped scene that
/// was probably meant.
Result<std::filesystem::path> find_scene(const std::string& name);

/// Names of all shipped scenes, sorted, each once.
std::vector<std::string> shipped_scenes();

}  // namespace kerf::app
