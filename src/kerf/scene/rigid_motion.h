// Where obstacles and the poses of tools are at a time, and how fast.
#pragma once

#include <array>
#include <vector>

#include "kerf/base/rigid_place.h"
#include "kerf/scene/scene.h"

namespace kerf {

/// The place that position and rotation (axis times angle, radians) of a scene mean.
inline RigidPlace place_of(Vec3 position, Vec3 rotation) { return {position, turn(rotation)}; }

/// On the way through `poses` (times ascend) from `start` at time 0; at rest after the last.
RigidPlace place_at(const RigidPlace& start, const std::vector<ScenePose>& poses, double time);

/// Velocities that carry one place to the other in dt seconds.
struct RigidVelocity {
  Vec3 linear;  ///< m/s, of the origin
  Vec3 spin;    ///< rad/s, world
};
RigidVelocity velocity_between(const RigidPlace& from, const RigidPlace& to, double dt);

inline RigidPlace place_at(const SceneObstacle& obstacle, double time) {
  return place_at(place_of(obstacle.position, obstacle.rotation), obstacle.moves, time);
}

/// Where the pose that a tool follows goes, and its jaws. Part of a session's state.
struct ToolMotion {
  RigidPlace start;                      ///< where the pose was when the motion was given
  std::vector<ScenePose> poses;          ///< times after `began`; empty: it stays at `start`
  double began = 0;                      ///< s
  double jaws_from = 1, jaws_to = 1;     ///< 1 open, 0 closed
  double jaws_began = 0, jaws_over = 0;  ///< s
  bool inside = false;                   ///< its edge is in tissue: the blade does not touch, it cuts
  bool in_slit = false;                  ///< scissors: they have cut, and their blades are still between the lips
  bool holding = false;                  ///< its jaws hold tissue
  bool placed = false;                   ///< base and tip hold the edge of the last step
  Vec3 base, tip;                        ///< m, world
  Vec3
      press;  ///< m: how far the edge that cuts has pressed into what has not given way; behind that, where it has gone back
  bool pressed = false;                    ///< with what it did in the last step
  double edge_force = 0, edge_length = 0;  ///< N, m: what the edge met in the last step, pressing
  std::array<bool, 2> jaw_pushes{};        ///< which jaws met something
  Vec3 force, torque;                      ///< N, N m: of what it holds, on the tool, in this step
  Vec3 resistance,
      resistance_torque;  ///< N, N m: of what it cuts, as far as the last step tells; what it really is, this step finds
  [[nodiscard]] bool is_between_lips() const { return inside || in_slit; }
  [[nodiscard]] RigidPlace pose(double time) const { return place_at(start, poses, time - began); }
  /// 1 open, 0 closed.
  [[nodiscard]] double jaws(double time) const;
};

/// At rest at the tool's start.
ToolMotion tool_at_start(const SceneRigidTool& tool);

}  // namespace kerf
