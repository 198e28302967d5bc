#include "scene_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <set>
#include <string_view>

#include "folder.h"
#include "kerf/base/shown_text.h"
#include "kerf/mesh/models.h"
#include "kerf/scene/closest_word.h"

namespace kerf::app {
namespace fs = std::filesystem;

namespace {

/// What there is of this name that is no file, in words; empty: nothing.
std::string what_else(const fs::path& path) {
  std::error_code code;
  if (!is_there(path)) return {};
  const fs::file_status status = fs::status(path, code);
  if (code == std::errc::too_many_symbolic_link_levels) return "is a symbolic link that leads round in a circle";
  if (!fs::exists(status))
    return fs::is_symlink(fs::symlink_status(path, code)) ? "is a symbolic link that leads nowhere"
                                                          : "can't be looked at";
  return fs::is_directory(status) ? "is a folder" : "is not a regular file";
}

}  // namespace

std::vector<fs::path> scene_folders() {
  std::vector<fs::path> out;
  if (const char* list = std::getenv("KERF_SCENES")) {
    std::string_view rest = list;
    while (!rest.empty()) {
      const std::size_t end = std::min(rest.find(':'), rest.size());
      if (end > 0) out.emplace_back(rest.substr(0, end));
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
  }
  std::error_code code;
  const fs::path program = fs::read_symlink("/proc/self/exe", code);
  const fs::path installed = program.parent_path().parent_path() / "share/kerf/scenes";
  if (!code) out.push_back(installed);
  // Of a program that is installed, in a wheel too, the source is nobody's business.
  if (code || !fs::is_directory(installed, code)) out.emplace_back(KERF_SCENES_SOURCE_DIR);
  return out;
}

Result<fs::path> find_scene(const std::string& name) {
  std::vector<fs::path> candidates{name, name + ".toml"};
  for (const fs::path& folder : scene_folders()) {
    candidates.push_back(folder / name);
    candidates.push_back(folder / (name + ".toml"));
  }
  std::error_code code;
  for (const fs::path& candidate : candidates) {
    if (fs::is_regular_file(candidate, code)) return candidate;
  }
  for (const fs::path& candidate : {candidates[0], candidates[1]})
    if (const std::string what = what_else(candidate); !what.empty())
      return bad_input(
          fmt::format("{}: {}, not a scene file; name a scene (kerf info --scenes lists those that are shipped)",
                      shown(candidate.string()), what));
  std::string message = fmt::format("there is no scene \"{}\"", shown(name));
  const std::vector<ModelName>& models = model_names();
  if (std::any_of(models.begin(), models.end(), [&](const ModelName& m) { return m.name == name; }))
    return bad_input(fmt::format(
        "{}: {} is a model. A scene file with the line body.model = \"{}\" runs it; kerf make {} --out FOLDER writes its "
        "meshes and such a scene",
        message, name, name, name));
  const std::vector<std::string> shipped = shipped_scenes();
  const std::vector<std::string_view> known(shipped.begin(), shipped.end());
  if (const std::string_view closest = closest_word(fs::path(name).stem().string(), known); !closest.empty()) {
    message += fmt::format("; did you mean \"{}\"?", closest);
  } else if (!shipped.empty()) {
    message += fmt::format("; shipped scenes are {}", fmt::join(shipped, ", "));
  }
  message += "\nlooked for it as a file";
  for (const fs::path& folder : scene_folders()) message += fmt::format(", in {}", shown(folder.string()));
  return bad_input(message);
}

std::vector<std::string> shipped_scenes() {
  std::set<std::string> names;
  std::error_code code;
  for (const fs::path& folder : scene_folders()) {
    for (auto it = fs::directory_iterator(folder, code); it != fs::directory_iterator(); it.increment(code)) {
      if (it->path().extension() == ".toml") names.insert(it->path().stem().string());
      if (code) break;
    }
  }
  return {names.begin(), names.end()};
}

}  // namespace kerf::app
