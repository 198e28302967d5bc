#include "kerf/scene/rigid_motion.h"

#include <algorithm>

namespace kerf {

RigidPlace place_at(const RigidPlace& start, const std::vector<ScenePose>& poses, double time) {
  RigidPlace before = start;
  double began = 0;
  for (const ScenePose& pose : poses) {
    const RigidPlace next = place_of(pose.position, pose.rotation);
    if (time < pose.time) return between(before, next, (time - began) / (pose.time - began));
    before = next;
    began = pose.time;
  }
  return before;
}

RigidVelocity velocity_between(const RigidPlace& from, const RigidPlace& to, double dt) {
  return {(1 / dt) * (to.position - from.position), (1 / dt) * turn_of(product(to.axes, transposed(from.axes)))};
}

double ToolMotion::jaws(double time) const {
  const double s = jaws_over > 0 ? std::clamp((time - jaws_began) / jaws_over, 0.0, 1.0) : 1.0;
  return jaws_from + s * (jaws_to - jaws_from);
}

ToolMotion tool_at_start(const SceneRigidTool& tool) {
  ToolMotion motion;
  motion.start = place_of(tool.position, tool.rotation);
  return motion;
}

}  // namespace kerf
