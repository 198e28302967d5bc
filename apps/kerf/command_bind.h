// kerf bind VISUAL [--collision MESH] --out FILE
#pragma once

#include <filesystem>
#include <optional>

namespace kerf::app {

struct BindOptions {
  std::filesystem::path visual;           ///< or a model's name
  std::filesystem::path collision;        ///< empty: made automatically from a closed visual mesh
  std::filesystem::path write_collision;  ///< where to save the mesh that was made; empty: nowhere
  std::filesystem::path diagnose;         ///< where to save the coloured surface (PLY); empty: nowhere
  std::size_t triangles = 0;              ///< wanted of the mesh that is made; 0: as many as it needs
  std::filesystem::path out;
  double scale = 1;                               ///< metres per unit of the files
  std::optional<double> thickness;                ///< metres, for an open visual mesh
  std::optional<double> weld;                     ///< metres; corners this close are one; 0: none
  std::optional<double> young, poisson, density;  ///< Pa, 1, kg/m3: kept in the file for scenes
  bool exact_paths = false;
  bool quiet = false;
};

/// Binds the two meshes (section 4.1 of the paper) and saves the bound body. Returns the exit status.
int bind_meshes(const BindOptions& options);

}  // namespace kerf::app
