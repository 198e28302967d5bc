// What a command reads and what it will write: no result takes the place of what it is made from, or of another result.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/scene/scene.h"

namespace kerf::app {

struct CommandFile {
  std::string what;  ///< for messages: "the scene", "the recording"
  std::filesystem::path path;
};

/// Files of these names in a folder for results.
std::vector<CommandFile> results_in(const std::filesystem::path& folder, const std::vector<std::string>& names);

/// What a body is read from; nothing for a model.
std::vector<CommandFile> files_of(const SceneBody& body);

/// What a scene is read from: its file, and every mesh and bound body that it names.
std::vector<CommandFile> files_of(const std::filesystem::path& file, const Scene& scene);

std::vector<std::filesystem::path> paths_of(const std::vector<CommandFile>& files);

/// To be asked before the work. Bad input: an output is an input or another output (same_file of whole_file.h); both are named.
Status check_outputs(const std::vector<CommandFile>& inputs, const std::vector<CommandFile>& outputs);

/// To be asked before the work. Bad input: the ending of the output's name, in capital or small letters, is none of these; "" stands for a
/// name without one.
Status check_ending(const CommandFile& output, const std::vector<std::string>& endings);

/// ".obj" of "a/b.OBJ"; empty: there is none.
std::string ending_of(const std::filesystem::path& path);

/// To be asked before the work, when the folders of the outputs are there. An error: the first that can't be written (check_can_be_written).
Status check_places(const std::vector<CommandFile>& outputs);

}  // namespace kerf::app
