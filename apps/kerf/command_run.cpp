#include "command_run.h"

#include "exit_status.h"
#include "kerf/session/scene_file.h"
#include "scene_search.h"

namespace kerf::app {

int run_scene(const RunOptions& options) {
  const Result<std::filesystem::path> path = find_scene(options.scene);
  if (!path.ok()) return report(path.error());
  Result<Scene> scene = read_scene(*path);
  if (!scene.ok()) return report(scene.error());
  if (options.duration) scene->simulation.duration = *options.duration;
  if (options.threads) scene->simulation.threads = *options.threads;
  return report(failed("run: the scene is valid, but simulating it is not built yet"));
}

}  // namespace kerf::app
