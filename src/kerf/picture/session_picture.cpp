#include "kerf/picture/session_picture.h"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "kerf/record/run_outputs.h"
#include "kerf/record/surface_export.h"
#include "kerf/scene/scene_shapes.h"
#include "kerf/scene/shape_mesh.h"

namespace kerf {
namespace {

std::vector<std::array<std::int32_t, 3>> corners(const TriangleMesh& mesh) {
  std::vector<std::array<std::int32_t, 3>> out;
  out.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) out.push_back({t[0].value, t[1].value, t[2].value});
  return out;
}

void append(std::vector<PictureLine>& lines, const std::vector<PictureLine>& more) {
  lines.insert(lines.end(), more.begin(), more.end());
}

/// Obstacles this many times larger than the body are not taken in whole.
constexpr double kFramed = 1.6;

PictureThing thing_of(const std::vector<ShapePart>& parts, const RigidPlace& place, double plane_size) {
  ShapeMesh mesh = shape_mesh(parts, plane_size);
  for (Vec3& p : mesh.positions) p = place.to_world(p);
  PictureThing thing;
  thing.positions = std::move(mesh.positions);
  thing.triangles = std::move(mesh.triangles);
  return thing;
}

/// Obstacles and tools as they stand. A level plane becomes the ground.
Result<std::vector<PictureThing>> things_of(const Session& session, Look look, const Box3& box,
                                            PictureOptions& options) {
  const Scene& scene = session.scene();
  std::vector<std::string> notes;
  auto shapes = load_scene_shapes(scene, notes);
  if (!shapes.ok()) return shapes.error();
  std::vector<PictureThing> things;
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i) {
    const SceneObstacle& obstacle = scene.obstacles[i];
    const RigidPlace place = place_at(obstacle, session.time());
    if (obstacle.shape == SceneShape::kPlane && place.axes.c[2].z > 1 - 1e-9) {
      options.ground_at = std::fmax(place.position.z, options.ground_at.value_or(-HUGE_VAL));
      continue;
    }
    PictureThing thing = thing_of(shapes->obstacles[i].parts, place, 3 * box.diagonal());
    Box3 own;
    for (const Vec3 p : thing.positions) own.add(p);
    thing.framed = own.diagonal() <= kFramed * box.diagonal();
    if (look == Look::kMeat && obstacle.shape == SceneShape::kBox) thing.stuff = PictureThing::Stuff::kWood;
    if (look == Look::kCartilage) thing.stuff = PictureThing::Stuff::kBone;
    things.push_back(std::move(thing));
  }
  const auto tools = session.tools();
  for (std::size_t i = 0; i < tools.size(); ++i) {
    PictureThing thing = thing_of(tool_parts(scene.tools[i], tools[i].jaws, shapes->tool_meshes[i]),
                                  {tools[i].place.position, tools[i].place.axes}, 0);
    thing.stuff = PictureThing::Stuff::kSteel;
    thing.framed = false;  // shafts are long
    things.push_back(std::move(thing));
  }
  return things;
}

}  // namespace

Result<Picture> draw_session(Session& session, const SceneOutput& output) {
  const Body& body = session.body();
  const TriangleMesh surface = visual_surface(body.complex, session.visual_positions());
  const auto triangles = corners(surface);
  std::vector<std::uint8_t> wall;
  for (const std::int32_t group : surface.group) wall.push_back(group == kCutGroup ? 1 : 0);

  const std::string look = body_look(session.scene());
  PictureBody drawn;
  drawn.positions = surface.positions.raw();
  drawn.rest = body.complex.visual.rest.raw();
  drawn.triangles = triangles;
  drawn.wall = wall;
  drawn.look = look == "steak" ? Look::kMeat : look == "meniscus" ? Look::kCartilage : Look::kSheet;

  std::vector<PictureLine> lines;
  if (output.wireframe) {
    const TriangleMesh collision = collision_surface(body.complex, session.collision_positions());
    append(lines, triangle_edges(surface.positions.raw(), triangles, {0, 0, 0}, 1, 0.5f));
    append(lines, triangle_edges(collision.positions.raw(), corners(collision), {1, 0.25f, 0}, 2.5f, 1));
    std::vector<std::array<std::int32_t, 8>> hexahedra;
    for (const HexId h : ids<HexId>(body.hex.hex_count())) {
      if (!body.hex.alive(h)) continue;
      std::array<std::int32_t, 8> nodes;
      for (std::size_t c = 0; c < 8; ++c) nodes[c] = body.hex.nodes[h][c].value;
      hexahedra.push_back(nodes);
    }
    std::vector<Vec3> shown;
    session.shown_nodes(shown);
    append(lines, hexahedron_edges(shown, hexahedra, 2, 1));
  }

  PictureOptions options;
  options.width = output.picture_size[0];
  options.height = output.picture_size[1];
  options.direction = output.camera.direction;
  options.up = output.camera.up;
  options.field_of_view = output.camera.field_of_view;
  options.zoom = output.camera.zoom;
  options.two_sided = !body.complex.closed;
  Box3 box;
  for (const Vec3 p : drawn.positions) box.add(p);
  const auto things = things_of(session, drawn.look, box, options);
  if (!things.ok()) return things.error();
  return draw_picture(drawn, lines, options, *things);
}

}  // namespace kerf
