// kerf run SCENE --out DIR, kerf run --from FILE --out DIR
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace kerf::app {

struct RunOptions {
  std::string scene;                ///< as typed: a path or the name of a shipped scene
  std::filesystem::path out;        ///< folder for all results; made when it does not exist
  std::optional<double> duration;   ///< s, instead of the scene's
  std::optional<int> threads;       ///< instead of the scene's
  std::vector<std::string> meshes;  ///< folders with mesh files, beside the scene's own
  std::filesystem::path record;     ///< a recording for kerf replay; empty: none
  std::filesystem::path save;       ///< a state to go on from; empty: none
  std::filesystem::path from;       ///< a saved state, instead of a scene
  bool quiet = false;               ///< no progress, no summary
};

/// Reads the scene, or goes on from a saved state, simulates it and writes report.json, the final meshes, the animation and the picture into
/// `out`. Returns the exit status.
int run_scene(const RunOptions& options);

}  // namespace kerf::app
