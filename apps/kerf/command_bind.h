// kerf bind VISUAL --collision MESH --out FILE
#pragma once

#include <filesystem>
#include <optional>

namespace kerf::app {

struct BindOptions {
  std::filesystem::path visual;
  std::filesystem::path collision;
  std::filesystem::path out;
  double scale = 1;                 ///< metres per unit of the files
  std::optional<double> thickness;  ///< metres, for an open visual mesh
  bool exact_paths = false;
  bool quiet = false;
};

/// Binds the two meshes (section 4.1 of the paper) and saves the bound body. Returns the exit status.
int bind_meshes(const BindOptions& options);

}  // namespace kerf::app
