#include "scene_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <set>
#include <string_view>

#include "kerf/session/closest_word.h"

namespace kerf::app {
namespace fs = std::filesystem;

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
  if (!code) out.push_back(program.parent_path().parent_path() / "share/kerf/scenes");
  out.emplace_back(KERF_SCENES_SOURCE_DIR);
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
  std::string message = fmt::format("there is no scene \"{}\"", name);
  const std::vector<std::string> shipped = shipped_scenes();
  const std::vector<std::string_view> known(shipped.begin(), shipped.end());
  if (const std::string_view closest = closest_word(fs::path(name).stem().string(), known);
      !closest.empty()) {
    message += fmt::format("; did you mean \"{}\"?", closest);
  } else if (!shipped.empty()) {
    message += fmt::format("; shipped scenes are {}", fmt::join(shipped, ", "));
  }
  message += "\nlooked for it as a file";
  for (const fs::path& folder : scene_folders()) message += fmt::format(", in {}", folder.string());
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
