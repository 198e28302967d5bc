// kerf info FILE, kerf info --schema
#pragma once

#include <string>

namespace kerf::app {

struct InfoOptions {
  std::string file;       ///< a mesh, a scene or a bound body
  bool schema = false;    ///< print the documentation of scene files
  bool markdown = false;  ///< as Markdown
  bool scenes = false;    ///< print the names of the shipped scenes
};

/// Prints what is known about a file. Returns the exit status.
int show_info(const InfoOptions& options);

}  // namespace kerf::app
