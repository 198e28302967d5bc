// Scenes from TOML files.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "kerf/base/result.h"
#include "kerf/session/scene.h"

namespace kerf {

/// Reads a scene file. Mesh files that it names are resolved against its folder and must exist; they are not
/// read. Bad input lists every problem found (up to 10), one a line, each with "file:line:", what is wrong
/// and what would be right: unknown keys with the closest known one, wrong types, numbers out of range,
/// blades without an edge, commands for grasps that don't exist, missing files.
Result<Scene> read_scene(const std::filesystem::path& path);

/// The same for a text. `name` stands for the file in messages; relative files start at `base_dir` ("": the
/// current folder).
Result<Scene> parse_scene(std::string_view text, std::string_view name,
                          const std::filesystem::path& base_dir = {});

}  // namespace kerf
