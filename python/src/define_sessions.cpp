#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "arrays.h"
#include "define.h"
#include "held_recording.h"
#include "live_session.h"
#include "python_lock.h"
#include "stroke.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace kerf::python {
namespace {

using Rows3 = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Path = nb::ndarray<const double, nb::shape<-1, 2, 3>, nb::c_contig, nb::device::cpu>;

}  // namespace

PictureView view_of(nb::handle eye, nb::handle target, nb::handle up, double field_of_view) {
  const PictureView view{point_of(eye, "eye"), point_of(target, "target"), point_of(up, "up"), field_of_view};
  if (const Status status = check_view(view); !status) throw nb::value_error(status.error().message.c_str());
  return view;
}

void define_sessions(nb::module_& m) {
  nb::class_<Snapshot> state(m, "Snapshot", "A state of one session, to go back to with its restore().");
  copy_is_itself(state, nb::sig("def __copy__(self) -> Snapshot"),
                 nb::sig("def __deepcopy__(self, memo: typing.Any) -> Snapshot"));
  state.def("__init__", refuse_to_make<Snapshot>("a snapshot comes from snapshot() of a kerf.Session"), kRefusesToMake)
      .def(
          "__reduce_ex__",
          [](const Snapshot& self, nb::handle) {
            const std::string bytes = snapshot_bytes(self);
            return nb::make_tuple(nb::module_::import_("kerf._session").attr("unpickled_snapshot"),
                                  nb::make_tuple(nb::bytes(bytes.data(), bytes.size())));
          },
          "protocol"_a, nb::sig("def __reduce_ex__(self, protocol: typing.SupportsIndex, /) -> typing.Any"));
  m.def(
      "snapshot_of_bytes",
      [](nb::bytes data) {
        return snapshot_of_bytes({data.c_str(), data.size()});
      },
      "data"_a);

  nb::class_<LiveSession>(m, "Session")
      .def(nb::init<const std::string&, const std::string&, const std::string&, const std::vector<std::string>&,
                    const nb::dict&, bool, bool>(),
           "text"_a, "name"_a, "folder"_a, "meshes"_a, "bodies"_a, "record"_a, "scripted"_a)
      .def(nb::init<const HeldRecording&, const std::vector<std::string>&>(), "recording"_a, "meshes"_a)
      .def(
          "__init__",
          [](LiveSession* self, const std::optional<nb::bytes>& data, const std::string& file,
             const std::vector<std::string>& meshes) {
            new (self) LiveSession(data ? data->c_str() : nullptr, data ? data->size() : 0, file, meshes);
          },
          "data"_a.none(), "file"_a, "meshes"_a)
      .def("_recording", &LiveSession::recording)
      .def("_saved_bytes",
           [](LiveSession& self) {
             const std::string bytes = self.saved_bytes();
             return nb::bytes(bytes.data(), bytes.size());
           })
      .def("_save", &LiveSession::save, "file"_a)
      .def(
          "step", [](LiveSession& self, nb::handle n) { self.step(steps_of(n, "n")); }, "n"_a.none() = 1,
          nb::sig("def step(self, n: int = 1) -> None"), R"(Simulates n time steps of time_step seconds each.

Ctrl-C ends it after a whole step. ValueError: n is negative. kerf.Error: a step can't be done; the body is as before that step.)")
      .def(
          "undo", &LiveSession::undo,
          "Takes the last stroke back, to the bit: that which is open, where it has cut. kerf.Error: there is none; an open stroke() goes on.")
      .def("redo", &LiveSession::redo,
           "Does the stroke again that was undone last. kerf.Error: there is none; an open stroke() goes on.")
      .def("validate", &LiveSession::validate, "Checks all invariants; kerf.Error names the first that does not hold.")
      .def("close", &LiveSession::close,
           "Frees the session now; all else then raises kerf.Error. Arrays that came from it stay.")
      .def("snapshot", &LiveSession::snapshot, "The complete state, undo steps included.")
      .def(
          "restore",
          [](LiveSession& self, nb::handle snapshot) {
            if (!nb::isinstance<Snapshot>(snapshot) || !nb::inst_ready(snapshot))
              nb::module_::import_("kerf._arguments").attr("refuse_snapshot")(snapshot);
            self.restore(nb::cast<const Snapshot&>(snapshot));
          },
          "snapshot"_a.none(), nb::sig("def restore(self, snapshot: Snapshot) -> None"),
          R"(Goes back to a snapshot of this session, to the bit.

A stroke() that was open then ends; a blade of the scene goes on. kerf.Error: the snapshot is of another session.)")
      .def(
          "stroke",
          [](nb::handle_t<LiveSession> self, nb::handle frame, nb::handle through) {
            if (!nb::inst_ready(self))
              throw nb::type_error("this session was not made: its class does not call kerf.Session.__init__");
            return Stroke(nb::borrow(self), frame_of(frame), flag_of(through, "through"));
          },
          "frame"_a.none() = "rest", "through"_a.none() = false,
          nb::sig("def stroke(self, frame: str = 'rest', through: bool = False) -> Stroke"),
          R"(A stroke of a blade, for `with`.

frame: its poses are in coordinates at rest ("rest") or where the body is now ("world").
through: cut every layer that the edge meets, not only the first. ValueError: another frame.)")
      .def(
          "_cut",
          [](LiveSession& self, const Path& poses, nb::handle frame, nb::handle through) {
            return self.cut(poses.data(), poses.shape(0), frame_of(frame), flag_of(through, "through"));
          },
          "poses"_a, "frame"_a.none(), "through"_a.none(),
          nb::sig("def _cut(self, poses: numpy.typing.NDArray[numpy.float64], frame: str, through: bool) -> bool"))
      .def(
          "_apply",
          [](LiveSession& self, const std::string& text, const std::string& name) {
            const LiveSession::Applied done = self.apply(text, name);
            return std::pair(done.stroke, done.removed);
          },
          "text"_a, "name"_a)
      .def(
          "_to_world",
          [](LiveSession& self, const Rows3& rest) {
            std::vector<Vec3> now(rest.shape(0));
            now.reserve(1);  // an array of no items still wants an address
            {
              const WithoutPythonLock release;
              self.places_now(rest.data(), now.size(), &now.data()->x);
            }
            const std::size_t rows = now.size();
            return read_only_array<double>(std::move(now), {rows, std::size_t{3}});
          },
          "rest"_a,
          nb::sig(
              "def _to_world(self, rest: numpy.typing.NDArray[numpy.float64]) -> numpy.typing.NDArray[numpy.float64]"))
      .def(
          "_to_rest",
          [](LiveSession& self, const Rows3& now) {
            std::vector<Vec3> rest(now.shape(0));
            rest.reserve(1);
            std::vector<double> distance(rest.size());
            {
              const WithoutPythonLock release;
              self.places_at_rest(now.data(), rest.size(), &rest.data()->x, distance.data());
            }
            const std::size_t rows = rest.size();
            return std::pair(read_only_array<double>(std::move(rest), {rows, std::size_t{3}}),
                             read_only_array<double>(std::move(distance), {rows}));
          },
          "now"_a,
          nb::sig("def _to_rest(self, now: numpy.typing.NDArray[numpy.float64]) -> "
                  "tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]"))
      .def("_contacts", &LiveSession::contacts, nb::sig("def _contacts(self) -> numpy.typing.NDArray[numpy.uint8]"))
      .def("_tools", &LiveSession::tools, nb::sig("def _tools(self) -> numpy.typing.NDArray[numpy.uint8]"))
      .def("_grasps", &LiveSession::grasps, nb::sig("def _grasps(self) -> numpy.typing.NDArray[numpy.uint8]"))
      .def("_report", &LiveSession::report_json)
      .def(
          "_open_view",
          [](LiveSession& self, int port, const std::string& token, std::uint64_t number,
             const std::string& embedders) {
            self.open_view({port, token, number, embedders});
          },
          "port"_a, "token"_a, "number"_a, "embedders"_a)
      .def("_close_view", &LiveSession::close_view)
      .def("_abandon_view", &LiveSession::abandon_view)
      .def("_view_address", &LiveSession::view_address)
      .def("_view_port", &LiveSession::view_port)
      .def("_expect_page", &LiveSession::expect_page, "ticket"_a)
      .def(
          "_camera",
          [](LiveSession& self, int width, int height) {
            const PictureView v = self.fitted_view(width, height);
            return std::tuple(std::tuple(v.eye.x, v.eye.y, v.eye.z), std::tuple(v.target.x, v.target.y, v.target.z),
                              std::tuple(v.up.x, v.up.y, v.up.z), v.field_of_view);
          },
          "width"_a, "height"_a)
      .def(
          "_render",
          [](LiveSession& self, int width, int height, const nb::object& camera, bool depth, bool shadows, bool alpha) {
            std::optional<PictureView> view;
            if (!camera.is_none())
              view = view_of(camera.attr("eye"), camera.attr("target"), camera.attr("up"),
                             nb::cast<double>(camera.attr("field_of_view")));
            return self.render(width, height, view, {depth, shadows, alpha});
          },
          "width"_a, "height"_a, "camera"_a.none(), "depth"_a, "shadows"_a, "alpha"_a,
          nb::sig(
              "def _render(self, width: int, height: int, camera: object, depth: bool, shadows: bool, alpha: bool) -> typing.Any"))
      .def_prop_ro("closed", &LiveSession::closed, "Has close() been called?")
      .def_prop_ro("time", &LiveSession::time, "Simulated time, seconds.")
      .def_prop_ro("time_step", &LiveSession::time_step, "Length of a step, seconds.")
      .def_prop_ro("steps", &LiveSession::steps, "Time steps taken.")
      .def_prop_ro("hash", &LiveSession::hash,
                   "A number for everything that the future depends on: same hash, same bits.")
      .def_prop_ro("topology_version", &LiveSession::topology_version,
                   "Grows with every change of topology, undo() and restore() included.")
      .def_prop_ro("undo_depth", &LiveSession::undo_depth, "Strokes that undo() can take back.")
      .def_prop_ro("redo_depth", &LiveSession::redo_depth, "Strokes that redo() can do again.")
      .def_prop_ro("in_stroke", &LiveSession::in_stroke, "Is a stroke open, by hand or by a blade of the scene?")
      .def_prop_ro("name", &LiveSession::name, "Name of the scene.")
      .def_prop_ro("title", &LiveSession::title, "Title of the scene.")
      .def_prop_ro(
          "counts", &LiveSession::counts, nb::for_getter(nb::sig("def counts(self) -> dict[str, int]")),
          "A dict: visual_vertices, visual_triangles, collision_vertices, collision_triangles, nodes, hexahedra, pieces.")
      .def_prop_ro("last_step", &LiveSession::last_step,
                   nb::for_getter(nb::sig("def last_step(self) -> dict[str, float]")),
                   "A dict of the last step: seconds (of computing), parts, topology_changed, iterations, residual.")
      .def_prop_ro("notes", &LiveSession::notes, "Warnings, in sentences.")
      .def_prop_ro("tool_ids", &LiveSession::tool_ids, "Ids of the scene's tools, in the order of `tools`.")
      .def_prop_ro("grasp_ids", &LiveSession::grasp_ids, "Ids of the grasps that hold, in the order of `grasps`.")
      .def_prop_ro(
          "support_force",
          [](LiveSession& self) {
            const Vec3 f = self.support_force();
            return std::tuple(f.x, f.y, f.z);
          },
          "Force of all supports on the body in the last step, newtons: (x, y, z).")
      .def_prop_ro("material", &LiveSession::material,
                   nb::for_getter(nb::sig("def material(self) -> dict[str, float]")),
                   "A dict: young (Pa), poisson, density (kg/m3).")
      .def("_set_material", &LiveSession::set_material, "young"_a, "poisson"_a, "density"_a)
      .def_prop_rw(
          "gravity",
          [](LiveSession& self) {
            const Vec3 g = self.gravity();
            return std::tuple(g.x, g.y, g.z);
          },
          [](LiveSession& self, nb::handle gravity) { self.set_gravity(point_of(gravity, "gravity")); },
          nb::for_setter("gravity"_a.none()),
          nb::for_setter(nb::sig("def gravity(self, gravity: numpy.typing.ArrayLike, /) -> None")),
          "m/s2, from the next step on: (x, y, z).")
      .def_prop_ro(
          "score", &LiveSession::score, nb::for_getter(nb::sig("def score(self) -> dict[str, float] | None")),
          "How the operation stands, in a scene with a lesion: lesion_volume (m3 at the start), lesion_removed (share), healthy_removed "
          "(m3), healthy_share, loose_pieces, roughness (m), largest_force (N of a tool, in any step).")
      .def_prop_ro("roughness", &LiveSession::roughness,
                   "RMS distance of all cut surfaces from their smooth shapes, metres.")
      .def_prop_ro(
          "piece_masses", [](LiveSession& self) { return self.piece_masses().first; },
          nb::for_getter(nb::sig("def piece_masses(self) -> numpy.typing.NDArray[numpy.float64]")),
          "Masses of the pieces of all bodies, kg, heaviest first: (pieces,).")
      .def_prop_ro(
          "uncut_mass", [](LiveSession& self) { return self.piece_masses().second; },
          "Mass of all bodies before anything was cut or taken away, of the present materials, kg.")
      .def_prop_ro("positions", &LiveSession::positions,
                   nb::for_getter(nb::sig("def positions(self) -> numpy.typing.NDArray[numpy.float64]")),
                   "Visual vertices, metres: (n, 3), float64.")
      .def_prop_ro("velocities", &LiveSession::velocities,
                   nb::for_getter(nb::sig("def velocities(self) -> numpy.typing.NDArray[numpy.float64]")),
                   "Velocities of the visual vertices, m/s: (n, 3), float64.")
      .def_prop_ro("normals", &LiveSession::normals,
                   nb::for_getter(nb::sig("def normals(self) -> numpy.typing.NDArray[numpy.float32]")),
                   "Unit normals at the visual vertices: (n, 3), float32.")
      .def_prop_ro("rest_positions", &LiveSession::rest_positions,
                   nb::for_getter(nb::sig("def rest_positions(self) -> numpy.typing.NDArray[numpy.float64]")),
                   "Visual vertices at rest, metres: (n, 3), float64.")
      .def_prop_ro("triangles", &LiveSession::triangles,
                   nb::for_getter(nb::sig("def triangles(self) -> numpy.typing.NDArray[numpy.int32]")),
                   "Visual vertices of each triangle: (m, 3), int32.")
      .def_prop_ro("walls", &LiveSession::walls,
                   nb::for_getter(nb::sig("def walls(self) -> numpy.typing.NDArray[numpy.bool_]")),
                   "Is this triangle of a wall that a cut made, not of the skin? (m,), bool.")
      .def_prop_ro("uvs", &LiveSession::uvs,
                   nb::for_getter(nb::sig("def uvs(self) -> numpy.typing.NDArray[numpy.float32]")),
                   "Texture coordinates of each corner of each triangle: (m, 3, 2), float32.")
      .def_prop_ro("collision_positions", &LiveSession::collision_positions,
                   nb::for_getter(nb::sig("def collision_positions(self) -> numpy.typing.NDArray[numpy.float64]")),
                   "Collision vertices, metres: (n, 3), float64.")
      .def_prop_ro("collision_rest_positions", &LiveSession::collision_rest_positions,
                   nb::for_getter(nb::sig("def collision_rest_positions(self) -> numpy.typing.NDArray[numpy.float64]")),
                   "Collision vertices at rest, metres: (n, 3), float64.")
      .def_prop_ro("collision_triangles", &LiveSession::collision_triangles,
                   nb::for_getter(nb::sig("def collision_triangles(self) -> numpy.typing.NDArray[numpy.int32]")),
                   "Collision vertices of each triangle: (m, 3), int32.")
      .def_prop_ro("nodes", &LiveSession::nodes,
                   nb::for_getter(nb::sig("def nodes(self) -> numpy.typing.NDArray[numpy.float64]")),
                   "Nodes of the hexahedra, metres, those that a cut has put out of use included: (n, 3), float64.")
      .def_prop_ro("node_velocities", &LiveSession::node_velocities,
                   nb::for_getter(nb::sig("def node_velocities(self) -> numpy.typing.NDArray[numpy.float64]")),
                   "Velocities of the nodes, m/s: (n, 3), float64.")
      .def_prop_ro("hexahedra", &LiveSession::hexahedra,
                   nb::for_getter(nb::sig("def hexahedra(self) -> numpy.typing.NDArray[numpy.int32]")),
                   "Nodes of each hexahedron: (m, 8), int32.");

  m.def(
      "check_camera",
      [](nb::handle eye, nb::handle target, nb::handle up, double field_of_view) {
        view_of(eye, target, up, field_of_view);
      },
      "eye"_a, "target"_a, "up"_a, "field_of_view"_a);
}

}  // namespace kerf::python
