// Scenes from TOML files.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/scene/scene.h"

namespace kerf {

/// Where the files that a scene names are looked for.
struct SceneFolders {
  SceneFolders() = default;
  SceneFolders(std::filesystem::path folder) : scene(std::move(folder)) {}  // NOLINT: mostly there is only one
  SceneFolders(const char* folder) : scene(folder) {}                       // NOLINT
  std::filesystem::path scene;                           ///< relative paths start here ("": the current folder),
  std::vector<std::filesystem::path> meshes;             ///< then here,
  std::map<std::string, std::filesystem::path> instead;  ///< but files written like this are there
  std::map<std::string, std::shared_ptr<const SceneBodyLoaded>>
      bodies;  ///< `bound` written like this is no file: a program has the body
  std::optional<std::vector<std::string>>
      only;  ///< names that a scene of somebody else may write; nothing is looked for by others
};

/// Reads a scene file. Mesh files that it names are resolved against its folder, then against `meshes`, and must exist; they are
/// not read. Bad input lists every problem found (up to 10), one a line, each with "file:line:", what is wrong
/// and what would be right: unknown keys with the closest known one, wrong types, numbers out of range,
/// blades without an edge, commands for grasps that don't exist, missing files.
Result<Scene> read_scene(const std::filesystem::path& path, const std::vector<std::filesystem::path>& meshes = {});

/// The same for a text. `name` stands for the file in messages; relative files start at
/// `folders`. Names that `folders.only` lacks are bad input, and say nothing of what there is.
Result<Scene> parse_scene(std::string_view text, std::string_view name, const SceneFolders& folders = {});

/// One command for a session that runs (Session::apply): the keys of a [[command]] without `at`, each at the top level. Its time is `now`.
/// `tools`: those there are; a first pose without rotation keeps theirs. Bad input: as of parse_scene. Grasps are not looked at.
Result<SceneCommand> parse_command(std::string_view text, std::string_view name, double now,
                                   std::span<const SceneRigidTool> tools);

}  // namespace kerf
