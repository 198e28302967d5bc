// A session's arrays, records and places.
#include <array>
#include <utility>
#include <vector>

#include "errors.h"
#include "kerf/session/material_places.h"
#include "live_session.h"
#include "live_session_use.h"
#include "python_lock.h"

namespace nb = nanobind;

namespace kerf::python {
namespace {

template <class Scalar, std::size_t kColumns, class Item>
nb::object rows_of(std::vector<Item> items) {
  static_assert(sizeof(Item) == kColumns * sizeof(Scalar));
  const std::size_t rows = items.size();
  return read_only_array<Scalar>(std::move(items), {rows, kColumns});
}
template <class VertexId>
nb::object triangles_of(std::vector<VertexId> corners) {
  static_assert(sizeof(VertexId) == sizeof(std::int32_t));
  const std::size_t rows = corners.size() / 3;
  return read_only_array<std::int32_t>(std::move(corners), {rows, 3});
}

/// Records as bytes, one row each.
template <class Record>
nb::object bytes_of(std::vector<Record> records) {
  const std::size_t count = records.size();
  return read_only_array<std::uint8_t>(std::move(records), {count, sizeof(Record)});
}

std::vector<Vec3> places_in(const double* numbers, std::size_t count) {
  std::vector<Vec3> out(count);
  for (std::size_t i = 0; i < count; ++i) out[i] = {numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]};
  return out;
}
void store(Vec3 p, double* to) {
  for (int i = 0; i < 3; ++i) to[i] = p[i];
}

}  // namespace

nb::object LiveSession::positions() {
  Use session(*this);
  return positions_.get(changes_,
                        [&] { return rows_of<double, 3>(unlocked([&] { return session->visual_positions(); })); });
}
nb::object LiveSession::velocities() {
  Use session(*this);
  return velocities_.get(changes_,
                         [&] { return rows_of<double, 3>(unlocked([&] { return session->visual_velocities(); })); });
}
nb::object LiveSession::normals() {
  Use session(*this);
  return normals_.get(changes_, [&] {
    std::vector<Vec3f> places, normals;
    unlocked([&] { session->visual_skin(places, normals); });
    return rows_of<float, 3>(std::move(normals));
  });
}
nb::object LiveSession::rest_positions() {
  Use session(*this);
  return rest_positions_.get(session->topology_version(), [&] {
    return rows_of<double, 3>(unlocked([&] { return session->body().complex.visual.rest.raw(); }));
  });
}
nb::object LiveSession::triangles() {
  Use session(*this);
  return triangles_.get(session->topology_version(), [&] {
    return triangles_of(unlocked([&] { return session->body().complex.visual.origin.raw(); }));
  });
}
nb::object LiveSession::walls() {
  Use session(*this);
  return walls_.get(session->topology_version(), [&] {
    std::vector<std::uint8_t> walls;
    for (const Patch patch : session->body().complex.visual.patch.raw()) walls.push_back(patch.is_wall() ? 1 : 0);
    const std::size_t rows = walls.size();
    return read_only_array<bool>(std::move(walls), {rows});
  });
}
nb::object LiveSession::uvs() {
  Use session(*this);
  return uvs_.get(session->topology_version(), [&] {
    std::vector<Vec2f> corners = session->body().complex.visual.texture.raw();
    const std::size_t rows = corners.size() / 3;
    return read_only_array<float>(std::move(corners), {rows, 3, 2});
  });
}
nb::object LiveSession::collision_positions() {
  Use session(*this);
  return collision_positions_.get(
      changes_, [&] { return rows_of<double, 3>(unlocked([&] { return session->collision_positions(); })); });
}
nb::object LiveSession::collision_rest_positions() {
  Use session(*this);
  return collision_rest_.get(session->topology_version(), [&] {
    return rows_of<double, 3>(unlocked([&] { return session->body().complex.collision.rest.raw(); }));
  });
}
nb::object LiveSession::collision_triangles() {
  Use session(*this);
  return collision_triangles_.get(session->topology_version(), [&] {
    return triangles_of(unlocked([&] { return session->body().complex.collision.origin.raw(); }));
  });
}
nb::object LiveSession::nodes() {
  Use session(*this);
  return nodes_.get(changes_, [&] { return rows_of<double, 3>(unlocked([&] { return session->node_positions(); })); });
}
nb::object LiveSession::node_velocities() {
  Use session(*this);
  return node_velocities_.get(changes_,
                              [&] { return rows_of<double, 3>(unlocked([&] { return session->node_velocities(); })); });
}
nb::object LiveSession::hexahedra() {
  Use session(*this);
  return hexahedra_.get(session->topology_version(), [&] {
    const HexMesh& mesh = session->body().hex;
    std::vector<std::array<NodeId, 8>> alive;
    for (const HexId h : ids<HexId>(mesh.hex_count()))
      if (mesh.alive(h)) alive.push_back(mesh.nodes[h]);
    return rows_of<std::int32_t, 8>(std::move(alive));
  });
}

nb::object LiveSession::contacts() {
  Use session(*this);
  return contacts_.get(changes_, [&] {
    std::vector<ContactRecord> records;
    for (const Session::ContactState& c : session->contacts()) records.push_back(record_of(c));
    return bytes_of(std::move(records));
  });
}
nb::object LiveSession::tools() {
  Use session(*this);
  return tools_.get(changes_, [&] {
    std::vector<ToolRecord> records;
    for (const Session::ToolState& t : session->tools()) records.push_back(record_of(t));
    return bytes_of(std::move(records));
  });
}
nb::object LiveSession::grasps() {
  Use session(*this);
  return grasps_.get(changes_, [&] {
    std::vector<GraspRecord> records;
    for (const Session::GraspState& g : session->grasps()) records.push_back(record_of(g, session->grasp_force(g.id)));
    return bytes_of(std::move(records));
  });
}
ToolRecord LiveSession::tool(const std::string& id) {
  Use session(*this);
  const std::vector<SceneRigidTool>& tools = session->scene().tools;
  for (std::size_t i = 0; i < tools.size(); ++i)
    if (tools[i].id == id) return record_of(session->tools()[i]);
  throw Failure(bad_input("there is no tool \"" + id + "\" in the scene"));
}
GraspRecord LiveSession::grasp(const std::string& id) {
  Use session(*this);
  for (const Session::GraspState& g : session->grasps())
    if (g.id == id) return record_of(g, session->grasp_force(id));
  return {};
}
std::vector<std::string> LiveSession::tool_ids() {
  Use session(*this);
  std::vector<std::string> out;
  for (const SceneRigidTool& tool : session->scene().tools) out.push_back(tool.id);
  return out;
}
std::vector<std::string> LiveSession::grasp_ids() {
  Use session(*this);
  std::vector<std::string> out;
  for (const Session::GraspState& g : session->grasps()) out.push_back(g.id);
  return out;
}
Vec3 LiveSession::support_force() { return Use(*this)->support_force(); }

void LiveSession::places_now(const double* rest, std::size_t count, double* now) {
  Use session(*this);
  const std::vector<Vec3> from = places_in(rest, count), to = kerf::places_now(*session, from);
  for (std::size_t i = 0; i < count; ++i) store(to[i], now + 3 * i);
}

void LiveSession::places_at_rest(const double* now, std::size_t count, double* rest, double* distance) {
  Use session(*this);
  const std::vector<MiddlePlace> to = kerf::places_at_rest(*session, places_in(now, count));
  for (std::size_t i = 0; i < count; ++i) {
    store(to[i].rest, rest + 3 * i);
    distance[i] = to[i].distance;
  }
}

}  // namespace kerf::python
