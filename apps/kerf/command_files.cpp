#include "command_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "folder.h"
#include "kerf/base/shown_text.h"
#include "kerf/mesh/whole_file.h"

namespace kerf::app {

std::vector<CommandFile> results_in(const std::filesystem::path& folder, const std::vector<std::string>& names) {
  std::vector<CommandFile> files;
  files.reserve(names.size());
  for (const std::string& name : names) files.push_back({"the result", folder / name});
  return files;
}

std::vector<CommandFile> files_of(const SceneBody& body) {
  std::vector<CommandFile> files;
  if (!body.visual.empty()) files.push_back({"the visual mesh", body.visual});
  if (!body.collision.empty()) files.push_back({"the collision mesh", body.collision});
  if (!body.bound.empty()) files.push_back({"the body", body.bound});
  return files;
}

std::vector<CommandFile> files_of(const std::filesystem::path& file, const Scene& scene) {
  std::vector<CommandFile> files{{"the scene", file}};
  for (const SceneFileUse& use : scene.files)
    files.push_back({fmt::format("the scene's \"{}\",", shown(use.written)), use.path});
  return files;
}

std::vector<std::filesystem::path> paths_of(const std::vector<CommandFile>& files) {
  std::vector<std::filesystem::path> paths;
  paths.reserve(files.size());
  for (const CommandFile& file : files) paths.push_back(file.path);
  return paths;
}

Status check_outputs(const std::vector<CommandFile>& inputs, const std::vector<CommandFile>& outputs) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const CommandFile& out = outputs[i];
    for (const CommandFile& in : inputs)
      if (is_there(in.path) && same_file(in.path.string(), out.path.string()))
        return bad_input(
            fmt::format("{} {} would replace {} {}: they are the same file; choose another place for what is written",
                        out.what, shown(out.path.string()), in.what, shown(in.path.string())));
    for (std::size_t k = 0; k < i; ++k)
      if (same_file(outputs[k].path.string(), out.path.string()))
        return bad_input(
            fmt::format("{} {} would replace {} {}: they are the same file; choose another place for one of them",
                        out.what, shown(out.path.string()), outputs[k].what, shown(outputs[k].path.string())));
  }
  return {};
}

std::string ending_of(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return ending;
}

Status check_ending(const CommandFile& output, const std::vector<std::string>& endings) {
  const std::string ending = ending_of(output.path);
  if (std::find(endings.begin(), endings.end(), ending) != endings.end()) return {};
  std::string known;
  for (const std::string& one : endings)
    if (!one.empty()) known += (known.empty() ? "" : " or ") + one;
  return bad_input(fmt::format("{}: {} is written as {}; choose a name that ends so", shown(output.path.string()),
                               output.what, known));
}

Status check_places(const std::vector<CommandFile>& outputs) {
  for (const CommandFile& out : outputs) KERF_TRY(check_can_be_written(out.path.string()));
  return {};
}

}  // namespace kerf::app
