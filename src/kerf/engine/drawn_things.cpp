#include "kerf/engine/drawn_things.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "kerf/scene/scene_keys.h"
#include "kerf/scene/shape_mesh.h"

namespace kerf {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kPlaneSize = 6;             ///< times the body's diagonal
constexpr std::size_t kMostContacts = 2000;  ///< that are drawn

/// Position and unit quaternion x y z w.
std::array<float, 7> pose(const RigidPlace& place) {
  const Vec3 turned = turn_of(place.axes);
  const double angle = norm(turned);
  const Vec3 v = angle > 0 ? (std::sin(angle / 2) / angle) * turned : Vec3{};
  const Vec3f p = to_float(place.position), q = to_float(v);
  return {p.x, p.y, p.z, q.x, q.y, q.z, static_cast<float>(std::cos(angle / 2))};
}

}  // namespace

Result<DrawnThings> DrawnThings::create(const Scene& scene, const Box3& body) {
  DrawnThings out;
  std::vector<std::string> notes;
  auto shapes = load_scene_shapes(scene, notes);
  if (!shapes) return shapes.error();
  Json things = Json::array();
  const auto part = [&](std::span<const ShapePart> shape, int side) {
    const ShapeMesh mesh = shape_mesh(shape, kPlaneSize * body.diagonal());
    for (const Vec3 p : mesh.positions) out.positions_.push_back(to_float(p));
    for (const auto& t : mesh.triangles) {
      protocol::Triangle corners;
      for (std::size_t k = 0; k < 3; ++k) corners[k] = static_cast<std::uint32_t>(t[k]);
      out.triangles_.push_back(corners);
    }
    return Json{{"vertices", mesh.positions.size()}, {"triangles", mesh.triangles.size()}, {"side", side}};
  };
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i) {
    const SceneObstacle& o = scene.obstacles[i];
    things.push_back({{"kind", "obstacle"},
                      {"shape", word_of(o.shape)},
                      {"name", o.name},
                      {"parts", Json::array({part(shapes->obstacles[i].parts, 0)})}});
  }
  for (std::size_t i = 0; i < scene.tools.size(); ++i) {
    const SceneRigidTool& t = scene.tools[i];
    // Jaws closed: whoever draws turns them about the hinge by side times half of the opening.
    const std::vector<ShapePart> parts = tool_parts(t, 0, shapes->tool_meshes[i]);
    Json list = Json::array();
    for (std::size_t k = 0; k < parts.size(); ++k)
      list.push_back(part({&parts[k], 1}, has_jaws(t) && k < 2 ? (k == 0 ? 1 : -1) : 0));
    things.push_back({{"kind", "tool"},
                      {"shape", word_of(t.kind)},
                      {"name", t.id},
                      {"jaws", has_jaws(t)},
                      {"opening", t.opening},
                      {"hinge", tool_sizes(t).tip},
                      {"parts", list}});
  }
  out.count_ = things.size();
  out.tools_ = scene.tools.size();
  out.json_ = Json{{"things", things}}.dump(-1, ' ', false, Json::error_handler_t::replace);
  return out;
}

protocol::Things DrawnThings::message() const {
  protocol::Things m;
  m.json = json_;
  m.positions = positions_;
  m.triangles = triangles_;
  return m;
}

void DrawnThings::place(const Session& session) {
  places_.clear();
  forces_.clear();
  if (empty()) return;
  const auto put = [&](const RigidPlace& place, double jaws) {
    const auto p = pose(place);
    protocol::Place& to = places_.emplace_back();
    std::copy(p.begin(), p.end(), to.begin());
    to[7] = static_cast<float>(jaws);
  };
  for (const SceneObstacle& o : session.scene().obstacles) put(place_at(o, session.time()), 1);
  for (const Session::ToolState& t : session.tools()) {
    put({t.place.position, t.place.axes}, t.jaws);
    const auto p = pose(t.pose);
    const Vec3f force = to_float(t.force), torque = to_float(t.torque);
    protocol::ToolForces& to = forces_.emplace_back();
    std::copy(p.begin(), p.end(), to.begin());
    const std::array<float, 7> rest{force.x, force.y, force.z, torque.x, torque.y, torque.z, 0};
    std::copy(rest.begin(), rest.end(), to.begin() + 7);
  }
}

void DrawnContacts::take(const Session& session) {
  points.clear();
  partners.clear();
  touching = 0;
  double sum = 0;
  for (const Session::ContactState& c : session.contacts()) {
    if (!(c.normal_force > 0)) continue;
    ++touching;
    sum += c.normal_force;
    if (points.size() == kMostContacts) continue;
    points.push_back({to_float(c.point), to_float(c.normal), to_float(c.force), static_cast<float>(c.gap)});
    const auto with = c.obstacle >= 0 ? protocol::ContactWith::kObstacle
                      : c.tool >= 0   ? protocol::ContactWith::kTool
                                      : protocol::ContactWith::kBody;
    partners.push_back(static_cast<std::uint32_t>(with) + (c.sliding ? protocol::kSliding : 0));
  }
  press = static_cast<float>(sum);
}

}  // namespace kerf
