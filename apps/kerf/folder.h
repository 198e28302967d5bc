// Folders for results, and what there is of a name.
#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/base/shown_text.h"
#include "kerf/mesh/whole_file.h"

namespace kerf::app {

/// Is there anything of this name, if only a link that leads nowhere or round in a circle?
inline bool is_there(const std::filesystem::path& path) {
  std::error_code code;
  return std::filesystem::exists(std::filesystem::symlink_status(path, code));
}

/// Makes the folder and those above it; they last as files do. Bad input: it can't be made, or is a file.
inline Status make_folder(const std::filesystem::path& folder) {
  if (folder.empty()) return bad_input("the folder for the results has no name; give one: --out FOLDER");
  std::error_code code;
  std::vector<std::filesystem::path> parents;  // of those that are to be made
  for (std::filesystem::path made = std::filesystem::absolute(folder, code); !code && !is_there(made);
       made = made.parent_path())
    parents.push_back(made.parent_path());
  std::filesystem::create_directories(folder, code);
  if (code || !std::filesystem::is_directory(folder, code)) {
    std::error_code none;
    const bool dangling = code == std::errc::file_exists && std::filesystem::is_symlink(folder, none);
    return bad_input(fmt::format("can't make the folder {}: {}; choose another place", shown(folder.string()),
                                 dangling ? "a link of that name leads nowhere"
                                 : code   ? code.message()
                                          : "it is a file"));
  }
  for (const std::filesystem::path& parent : parents) KERF_TRY(keep_names(parent.string()));
  return {};
}

}  // namespace kerf::app
