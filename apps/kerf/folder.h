// Folders for results.
#pragma once

#include <fmt/format.h>

#include <filesystem>

#include "kerf/base/result.h"

namespace kerf::app {

/// Makes the folder and those above it. Bad input: it can't be made, or is a file.
inline Status make_folder(const std::filesystem::path& folder) {
  std::error_code code;
  std::filesystem::create_directories(folder, code);
  if (code || !std::filesystem::is_directory(folder)) {
    return bad_input(
        fmt::format("can't make the folder {}: {}", folder.string(), code ? code.message() : "it is a file"));
  }
  return {};
}

}  // namespace kerf::app
