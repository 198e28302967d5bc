#include "kerf/scene/scene_shapes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "kerf/base/shown_text.h"
#include "kerf/mesh/mesh_file.h"
#include "kerf/mesh/rigid_models.h"
#include "kerf/mesh/surface_check.h"
#include "kerf/scene/scene_place.h"

namespace kerf {
namespace {

/// What the kinds are like when the scene does not say, metres.
ToolSizes own_sizes(SceneToolKind kind) {
  ToolSizes sizes{0.12, 0.0015, 0, 0.006, 0.0006};
  switch (kind) {
    case SceneToolKind::kProbe: sizes.tip = 0.004; break;
    case SceneToolKind::kGrasper:
      sizes.tip = 0.012;
      sizes.width = 0.004;
      break;
    case SceneToolKind::kScalpel: sizes.tip = 0.025; break;
    case SceneToolKind::kScissors: sizes.tip = 0.02; break;
    case SceneToolKind::kSphere: sizes.radius = 0.005; break;
    case SceneToolKind::kMesh: break;
    case SceneToolKind::kShaver: break;
  }
  return sizes;
}

/// A jaw or blade that hangs from its hinge at (0, 0, tip), turned by `angle` about y: a box `thick` in x to one side of the
/// line where the two meet, `wide` in y.
ShapePart jaw_part(double tip, double angle, double side, double thick, double wide) {
  const Mat3 axes = turn({0, side * angle, 0});
  const Vec3 hinge{0, 0, tip};
  const double rounding = 0.25 * std::min({thick, wide, tip});
  return box_part(hinge + axes * Vec3{-side * thick / 2, 0, -tip / 2},
                  {thick / 2 - rounding, wide / 2 - rounding, tip / 2 - rounding}, axes, rounding);
}

Result<std::shared_ptr<const ObstacleMesh>> prepare(TriangleMesh mesh, const std::string& file,
                                                    std::vector<std::string>& notes) {
  const std::string name = shown(file);
  SurfaceRequirements requirements;
  requirements.name = name;
  requirements.single_body = false;
  const Result<SurfaceReport> checked = check_surface(mesh, requirements);
  if (!checked.ok()) return checked.error();
  for (const auto* list : {&checked->repairs, &checked->warnings})
    for (const std::string& sentence : *list) notes.push_back(fmt::format("{}: {}", name, sentence));
  Result<ObstacleMesh> made = make_obstacle_mesh(mesh);
  if (!made.ok()) return made.error();
  return std::shared_ptr<const ObstacleMesh>(std::make_shared<ObstacleMesh>(std::move(*made)));
}

Result<std::shared_ptr<const ObstacleMesh>> read(const std::string& file, double scale,
                                                 std::vector<std::string>& notes) {
  Result<TriangleMesh> mesh = read_mesh(file);
  if (!mesh.ok()) return mesh.error();
  for (Vec3& p : mesh->positions) p = scale * p;
  return prepare(std::move(*mesh), file, notes);
}

Result<ShapePart> obstacle_part(const SceneObstacle& obstacle, std::vector<std::string>& notes) {
  switch (obstacle.shape) {
    case SceneShape::kPlane: return plane_part({}, {0, 0, 1});
    case SceneShape::kSphere: return sphere_part({}, obstacle.radius);
    case SceneShape::kCapsule:
      return capsule_part({0, 0, -obstacle.length / 2}, {0, 0, obstacle.length / 2}, obstacle.radius);
    case SceneShape::kBox: return box_part({}, 0.5 * obstacle.size);
    case SceneShape::kMesh: break;
  }
  if (obstacle.model.empty()) {
    auto mesh = read(obstacle.mesh, obstacle.scale, notes);
    if (!mesh.ok()) return mesh.error();
    return mesh_part(std::move(*mesh));
  }
  Result<TriangleMesh> made = make_rigid_model(obstacle.model, obstacle.scale);
  if (!made.ok()) return made.error();
  auto mesh = prepare(std::move(*made), obstacle.model, notes);
  if (!mesh.ok()) return mesh.error();
  return mesh_part(std::move(*mesh));
}

}  // namespace

ToolSizes tool_sizes(const SceneRigidTool& tool) {
  const ToolSizes own = own_sizes(tool.kind);
  return {tool.length.value_or(own.length), tool.radius.value_or(own.radius), tool.tip.value_or(own.tip),
          tool.width.value_or(own.width), tool.thickness.value_or(own.thickness)};
}

ToolEdge tool_edge(const SceneRigidTool& tool, double jaws) {
  const ToolSizes s = tool_sizes(tool);
  if (tool.kind != SceneToolKind::kScissors) return {{0, 0, s.tip}, {}, {1, 0, 0}};
  const double reach = s.tip * std::tan(tool.opening / 2), height = s.tip * jaws;
  return {{-reach, 0, height}, {reach, 0, height}, {0, 0, -1}};
}

ToolBlade tool_blade(const SceneRigidTool& tool, double jaws) {
  const ToolSizes s = tool_sizes(tool);
  const ToolEdge e = tool_edge(tool, jaws);
  if (tool.kind != SceneToolKind::kScissors) return {{}, {}, s.tip, s.width, s.thickness};
  const Vec3 along = normalized(e.tip - e.base);
  return {e.base, {{e.forward, cross(along, e.forward), along}}, norm(e.tip - e.base), s.tip - e.base.z, s.thickness};
}

std::vector<ShapePart> tool_parts(const SceneRigidTool& tool, double jaws, const std::vector<ShapePart>& loaded) {
  if (!loaded.empty()) return loaded;
  const ToolSizes s = tool_sizes(tool);
  // Its round end meets the hinge: whatever touches below is a blade's or a jaw's (Session::Impl::leaves_out).
  const ShapePart shaft =
      capsule_part({0, 0, s.tip + std::min(s.radius, 0.5 * s.length)}, {0, 0, s.tip + s.length}, s.radius);
  const double angle = jaws * tool.opening / 2;
  switch (tool.kind) {
    case SceneToolKind::kProbe:
      return {capsule_part({}, {s.tip, 0, 0}, 0.8 * s.radius), capsule_part({}, {0, 0, s.length}, s.radius)};
    case SceneToolKind::kGrasper:
      return {jaw_part(s.tip, angle, 1, s.radius, s.width), jaw_part(s.tip, angle, -1, s.radius, s.width), shaft};
    case SceneToolKind::kScalpel: {
      const double edge = std::min({s.thickness, s.width, s.tip}) / 2;
      const double rounding = 0.9 * std::min({s.thickness / 2, (s.width - edge) / 2,
                                              s.tip / 2});  // blades may be as thick as they are wide
      const ShapePart blade =
          box_part({-(s.width + edge) / 2, 0, s.tip / 2},
                   {(s.width - edge) / 2 - rounding, s.thickness / 2 - rounding, s.tip / 2 - rounding}, {}, rounding);
      return {capsule_part({-edge, 0, edge}, {-edge, 0, s.tip}, edge), blade, shaft};
    }
    case SceneToolKind::kScissors:
      return {jaw_part(s.tip, angle, 1, s.width / 2, s.thickness), jaw_part(s.tip, angle, -1, s.width / 2, s.thickness),
              shaft};
    case SceneToolKind::kSphere: return {sphere_part({}, s.radius)};
    case SceneToolKind::kMesh: break;
    case SceneToolKind::kShaver: return {capsule_part({0, 0, s.radius}, {0, 0, s.radius + s.length}, s.radius)};
  }
  return {};
}

Result<SceneShapes> load_scene_shapes(const Scene& scene, std::vector<std::string>& notes) {
  SceneShapes shapes;
  for (const SceneObstacle& obstacle : scene.obstacles) {
    Result<ShapePart> part = obstacle_part(obstacle, notes);
    if (!part.ok()) return at_line(scene, obstacle.line, part.error());
    RigidShape& shape = shapes.obstacles.emplace_back();
    shape.parts.push_back(std::move(*part));
    shape.friction = obstacle.friction.value_or(scene.contact.friction);
    place_shape(place_at(obstacle, 0), place_at(obstacle, 0), 1, shape);
    if (const Status valid = validate_shape(shape); !valid.ok()) return at_line(scene, obstacle.line, valid.error());
  }
  for (const SceneRigidTool& tool : scene.tools) {
    std::vector<ShapePart>& parts = shapes.tool_meshes.emplace_back();
    if (!tool.mesh.empty()) {
      auto mesh = read(tool.mesh, tool.scale, notes);
      if (!mesh.ok()) return at_line(scene, tool.line, mesh.error());
      parts.push_back(mesh_part(std::move(*mesh)));
    }
    RigidShape shape;
    shape.parts = tool_parts(tool, 1, parts);
    if (const Status valid = validate_shape(shape); !valid.ok()) return at_line(scene, tool.line, valid.error());
  }
  return shapes;
}

void place_shape(const RigidPlace& from, const RigidPlace& to, double dt, RigidShape& shape) {
  const RigidVelocity v = velocity_between(from, to, dt);
  shape.position = from.position;
  shape.axes = from.axes;
  shape.velocity = v.linear;
  shape.spin = v.spin;
}

}  // namespace kerf
