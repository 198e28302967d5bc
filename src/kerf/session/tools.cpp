// Commands for tools: where their poses go, and their jaws.
#include <fmt/format.h>

#include <cmath>

#include "kerf/base/shown_text.h"
#include "kerf/session/session_impl.h"

namespace kerf {
namespace {

/// Number of the tool of this name, or -1.
int tool_named(const Scene& scene, const std::string& id) {
  for (std::size_t i = 0; i < scene.tools.size(); ++i)
    if (scene.tools[i].id == id) return static_cast<int>(i);
  return -1;
}

}  // namespace

Status Session::Impl::move_tool(const SceneToolMotion& what) {
  const int tool = tool_named(scene, what.id);
  if (tool < 0) return bad_input(fmt::format("there is no tool '{}' to move", kerf::shown(what.id)));
  double last = -1;
  for (const ScenePose& pose : what.poses) {
    if (!is_finite(pose.position) || !is_finite(pose.rotation) || !std::isfinite(pose.time))
      return bad_input(fmt::format("tool '{}': poses must be finite numbers", kerf::shown(what.id)));
    if (!(pose.time >= 0 && pose.time > last))
      return bad_input(fmt::format("tool '{}': times of poses must be 0 or more and increase", kerf::shown(what.id)));
    last = pose.time;
  }
  ToolMotion& motion = state.tools[static_cast<std::size_t>(tool)];
  motion.start = motion.pose(state.time);
  motion.poses = what.poses;
  motion.began = state.time;
  return {};
}

Status Session::Impl::move_jaws(const SceneJaws& what) {
  const std::string_view verb = what.close ? "close" : "open";
  const int tool = tool_named(scene, what.id);
  if (tool < 0) return bad_input(fmt::format("there is no tool '{}' to {}", kerf::shown(what.id), verb));
  if (!has_jaws(scene.tools[static_cast<std::size_t>(tool)]))
    return bad_input(fmt::format("tool '{}' has no jaws to {}", kerf::shown(what.id), verb));
  if (!(what.over >= 0 && std::isfinite(what.over)))
    return bad_input(fmt::format("{} of tool '{}': over must be a finite time", verb, kerf::shown(what.id)));
  ToolMotion& motion = state.tools[static_cast<std::size_t>(tool)];
  motion.jaws_from = motion.jaws(state.time);
  motion.jaws_to = what.close ? 0 : 1;
  motion.jaws_began = state.time;
  motion.jaws_over = what.over;
  if (!what.close) return let_go(static_cast<std::size_t>(tool));
  return {};
}

}  // namespace kerf
