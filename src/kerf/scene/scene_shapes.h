// The rigid shapes of a scene's obstacles and tools.
#pragma once

#include <string>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/contact/rigid_shape.h"
#include "kerf/scene/rigid_motion.h"
#include "kerf/scene/scene.h"

namespace kerf {

/// Sizes of a tool, in metres: what the scene gives, else the kind's own.
struct ToolSizes {
  double length = 0, radius = 0, tip = 0, width = 0, thickness = 0;
};
ToolSizes tool_sizes(const SceneRigidTool& tool);

/// The edge that cuts, in the tool's axes; for scissors it runs from one blade to the other, where they meet.
struct ToolEdge {
  Vec3 base, tip;  ///< metres
  Vec3 forward;    ///< unit: where it cuts to
};
inline bool has_edge(const SceneRigidTool& tool) {
  return tool.sharp && (tool.kind == SceneToolKind::kScalpel || tool.kind == SceneToolKind::kScissors);
}
/// jaws: 1 open, 0 closed.
ToolEdge tool_edge(const SceneRigidTool& tool, double jaws);

/// What is in the slit behind an edge, in the tool's axes: from the edge back by `width`. Of scissors, the blades that have met.
struct ToolBlade {
  Vec3 origin;                                  ///< metres: one end of the edge
  Mat3 axes;                                    ///< columns: forward, across, along the edge
  double length = 0, width = 0, thickness = 0;  ///< m
};
ToolBlade tool_blade(const SceneRigidTool& tool, double jaws);

/// Parts of a tool in its axes. A scalpel's edge is a part of its own, number
/// kEdgePart, which presses and does not when it cuts. A tool from a mesh has the shape that `loaded` holds.
std::vector<ShapePart> tool_parts(const SceneRigidTool& tool, double jaws, const std::vector<ShapePart>& loaded = {});
inline constexpr std::int32_t kEdgePart = 0;

/// Shapes of all obstacles, at time 0, and the parts of each tool that comes from a mesh (empty for others). Bad input:
/// mesh files that can't be read or checked; file and line of the scene are named. `notes` gets repairs and warnings.
struct SceneShapes {
  std::vector<RigidShape> obstacles;
  std::vector<std::vector<ShapePart>> tool_meshes;
};
Result<SceneShapes> load_scene_shapes(const Scene& scene, std::vector<std::string>& notes);

/// Puts a shape where it is, with the velocity that takes it to where it will be in dt seconds.
void place_shape(const RigidPlace& from, const RigidPlace& to, double dt, RigidShape& shape);

}  // namespace kerf
