// kerf make MODEL --out DIR
#pragma once

#include <filesystem>
#include <string>

#include "kerf/mesh/models.h"

namespace kerf::app {

struct MakeOptions {
  std::string model;
  ModelOptions options;
  std::filesystem::path out;
  std::string format = "obj";  ///< obj or ply
  bool replace = false;        ///< files in the folder that have other bytes, too
};

/// Generates a model and writes visual and collision mesh and a scene that uses them. Returns the exit
/// status.
int make_meshes(const MakeOptions& options);

}  // namespace kerf::app
