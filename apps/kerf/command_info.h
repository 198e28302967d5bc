// kerf info FILE, kerf info --schema
#pragma once

#include <optional>
#include <string>

namespace kerf::app {

struct InfoOptions {
  std::string file;            ///< a mesh, a scene or a bound body
  double scale = 1;            ///< metres per unit of a mesh
  std::optional<double> weld;  ///< metres; corners of a mesh this close are one; 0: none
  bool schema = false;         ///< print the documentation of scene files
  bool markdown = false;       ///< as Markdown
  bool scenes = false;         ///< print the names of the shipped scenes
};

/// Prints what is known about a file. Returns the exit status.
int show_info(const InfoOptions& options);

}  // namespace kerf::app
