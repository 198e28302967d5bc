#include "kerf/picture/session_picture.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "kerf/record/run_outputs.h"
#include "kerf/record/surface_export.h"

namespace kerf {
namespace {

/// Obstacles this many times larger than the body are not taken in whole.
constexpr double kFramed = 1.6;
constexpr double kPlaneSize = 3;  // times the body's diagonal
/// Bone above what is operated on: it would hide it.
constexpr const char* kAbove = "femur";

std::vector<std::array<std::int32_t, 3>> corners(const TriangleMesh& mesh) {
  std::vector<std::array<std::int32_t, 3>> out;
  out.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) out.push_back({t[0].value, t[1].value, t[2].value});
  return out;
}

void append(std::vector<PictureLine>& lines, const std::vector<PictureLine>& more) {
  lines.insert(lines.end(), more.begin(), more.end());
}

void place_thing(const ShapeMesh& mesh, const RigidPlace& place, PictureThing& thing) {
  thing.positions.clear();
  for (const Vec3 p : mesh.positions) thing.positions.push_back(place.to_world(p));
  thing.triangles = mesh.triangles;
}

PictureOptions options_of(const SceneCamera& camera) {
  PictureOptions options;
  options.direction = camera.direction;
  options.up = camera.up;
  options.field_of_view = camera.field_of_view;
  options.zoom = camera.zoom;
  return options;
}

}  // namespace

Result<SessionPainter> SessionPainter::create(const Session& session) {
  std::vector<std::string> notes;
  auto shapes = load_scene_shapes(session.scene(), notes);
  if (!shapes.ok()) return shapes.error();
  SessionPainter out;
  out.shapes_ = std::move(*shapes);
  out.obstacles_.resize(out.shapes_.obstacles.size());
  const std::string look = body_look(session.scene());
  out.look_ = look == "steak" ? Look::kMeat : look == "meniscus" ? Look::kCartilage : Look::kSheet;
  return out;
}

PictureBody SessionPainter::body(const Session& session) const {
  return {positions_, session.body().complex.visual.rest.raw(), triangles_, wall_, look_};
}

void SessionPainter::gather(Session& session) {
  if (version_ != session.topology_version()) gather_topology(session);
  positions_ = session.visual_positions();
  Box3 box;
  for (const Vec3 p : positions_) box.add(p);
  things_.resize(obstacles_.size() + session.scene().tools.size());
  gather_obstacles(session, box);
  gather_tools(session);
}

void SessionPainter::gather_topology(const Session& session) {
  const VisualMesh& mesh = session.body().complex.visual;
  triangles_.resize(mesh.face_count());
  wall_.resize(mesh.face_count());
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const VisualTriangle face(f);
    for (std::size_t k = 0; k < 3; ++k)
      triangles_[f][k] = mesh.origin[VisualMesh::corner(face, static_cast<int>(k))].value;
    wall_[f] = mesh.patch[face].is_wall() ? 1 : 0;
  }
  version_ = session.topology_version();
}

void SessionPainter::gather_obstacles(const Session& session, const Box3& box) {
  const Scene& scene = session.scene();
  ground_at_.reset();
  for (std::size_t i = 0; i < obstacles_.size(); ++i) {
    const SceneObstacle& obstacle = scene.obstacles[i];
    PictureThing& thing = things_[i];
    const RigidPlace place = place_at(obstacle, session.time());
    const bool ground = obstacle.shape == SceneShape::kPlane && place.axes.c[2].z > 1 - 1e-9;
    if (ground) ground_at_ = std::fmax(place.position.z, ground_at_.value_or(-HUGE_VAL));
    if (ground || obstacle.name == kAbove) {
      thing.positions.clear();
      thing.triangles.clear();
      continue;
    }
    const double plane_size = obstacle.shape == SceneShape::kPlane ? kPlaneSize * box.diagonal() : 0;
    if (obstacles_[i].plane_size != plane_size)
      obstacles_[i] = {plane_size, shape_mesh(shapes_.obstacles[i].parts, plane_size)};
    place_thing(obstacles_[i].mesh, place, thing);
    Box3 own;
    for (const Vec3 p : thing.positions) own.add(p);
    thing.framed = own.diagonal() <= kFramed * box.diagonal();
    thing.stuff = look_ == Look::kCartilage                                    ? PictureThing::Stuff::kBone
                  : look_ == Look::kMeat && obstacle.shape == SceneShape::kBox ? PictureThing::Stuff::kWood
                                                                               : PictureThing::Stuff::kStone;
  }
}

void SessionPainter::gather_tools(const Session& session) {
  const auto tools = session.tools();
  for (std::size_t i = 0; i < tools.size(); ++i) {
    PictureThing& thing = things_[obstacles_.size() + i];
    const auto parts = tool_parts(session.scene().tools[i], tools[i].jaws, shapes_.tool_meshes[i]);
    place_thing(shape_mesh(parts, 0), {tools[i].place.position, tools[i].place.axes}, thing);
    thing.stuff = PictureThing::Stuff::kSteel;
    thing.framed = false;  // shafts are long
  }
}

PictureView SessionPainter::fitted_view(Session& session, const SceneCamera& camera, int width, int height) {
  gather(session);
  std::vector<Vec3> framed = positions_;
  for (const PictureThing& thing : things_)
    if (thing.framed) framed.insert(framed.end(), thing.positions.begin(), thing.positions.end());
  Box3 box;
  for (const Vec3 p : framed) box.add(p);
  return view_of(fitted_camera(framed, positions_.size(), options_of(camera), width, height), box.center(),
                 camera.field_of_view);
}

void SessionPainter::draw_quickly(Session& session, const PictureView& view, const QuickTarget& target) {
  gather(session);
  const PictureBody drawn = body(session);
  if (!target.rgb.empty() && texture_version_ != version_) {
    texture_.emplace(drawn);
    texture_version_ = version_;
  }
  quick_.draw({drawn, texture_ ? &*texture_ : nullptr, things_, ground_at_}, view, target);
}

std::vector<PictureLine> SessionPainter::wireframe(Session& session) const {
  const Body& body = session.body();
  std::vector<PictureLine> lines;
  const TriangleMesh collision = collision_surface(body.complex, session.collision_positions());
  append(lines, triangle_edges(positions_, triangles_, {0, 0, 0}, 1, 0.5f));
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
  return lines;
}

Picture SessionPainter::draw(Session& session, const SceneOutput& output, const std::optional<PictureView>& view,
                             std::function<bool()> stop) {
  gather(session);
  PictureOptions options = options_of(output.camera);
  options.view = view;
  options.width = output.picture_size[0];
  options.height = output.picture_size[1];
  options.two_sided = !session.body().complex.closed;
  options.ground_at = ground_at_;
  options.stop = std::move(stop);
  std::vector<PictureLine> lines;
  if (output.wireframe) lines = wireframe(session);
  return draw_picture(body(session), lines, options, things_);
}

}  // namespace kerf
