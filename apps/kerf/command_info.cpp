#include "command_info.h"

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>

#include "exit_status.h"
#include "kerf/session/scene_file.h"
#include "kerf/session/scene_schema.h"
#include "scene_search.h"

namespace kerf::app {
namespace {

std::string command_text(const SceneCommand& command) {
  switch (command.what.index()) {
    case 0: {
      const auto& blade = std::get<SceneBlade>(command.what);
      return fmt::format("blade, {} poses in {:g} s, {} frame", blade.poses.size(), blade.poses.back().time,
                         blade.frame == SceneFrame::kRest ? "rest" : "world");
    }
    case 1:
      return fmt::format("grasp \"{}\"", std::get<SceneGrasp>(command.what).id);
    case 2:
      return fmt::format("move \"{}\"", std::get<SceneMove>(command.what).id);
    case 3:
      return fmt::format("release \"{}\"", std::get<SceneRelease>(command.what).id);
    case 4:
      return "fix";
    case 5:
      return "unfix";
    case 6:
      return fmt::format("undo {}", std::get<SceneUndo>(command.what).count);
    default:
      return fmt::format("redo {}", std::get<SceneRedo>(command.what).count);
  }
}

int show_scene(const std::filesystem::path& path) {
  const Result<Scene> read = read_scene(path);
  if (!read.ok()) return report(read.error());
  const Scene& scene = *read;
  std::string out = fmt::format("scene     {}\n", path.string());
  if (!scene.title.empty()) out += fmt::format("title     {}\n", scene.title);
  if (!scene.body.model.empty()) out += fmt::format("body      model {}\n", scene.body.model);
  if (!scene.body.visual.empty())
    out += fmt::format("body      {} bound to {}\n", scene.body.visual, scene.body.collision);
  if (!scene.body.bound.empty()) out += fmt::format("body      {}\n", scene.body.bound);
  out += fmt::format("time      {:g} s in steps of {:g} s\n", scene.simulation.duration,
                     scene.simulation.time_step);
  out += fmt::format("fixed     {} regions\nloads     {}\n", scene.fixes.size(), scene.loads.size());
  for (const SceneCommand& command : scene.commands)
    out += fmt::format("{:7.3f} s {}\n", command.at, command_text(command));
  std::fputs(out.c_str(), stdout);
  return kSuccess;
}

}  // namespace

int show_info(const InfoOptions& options) {
  if (options.schema) {
    std::fputs((options.markdown ? scene_schema_markdown() : scene_schema_text()).c_str(), stdout);
    return kSuccess;
  }
  if (options.scenes) {
    for (const std::string& name : shipped_scenes()) std::printf("%s\n", name.c_str());
    return kSuccess;
  }
  if (options.file.empty())
    return report(bad_input("info: name a file, or say --schema or --scenes; see kerf info --help"));
  const std::filesystem::path path = options.file;
  const std::string ending = path.extension().string();
  if (ending == ".toml" || (ending.empty() && !std::filesystem::exists(path))) {
    const Result<std::filesystem::path> scene = find_scene(options.file);
    if (!scene.ok()) return report(scene.error());
    return show_scene(*scene);
  }
  return report(failed("info: meshes and bound bodies are not built yet"));
}

}  // namespace kerf::app
