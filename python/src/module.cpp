// The extension module kerf._core. What stands in python/kerf/*.py makes it comfortable.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "arrays.h"
#include "batch.h"
#include "errors.h"
#include "held_recording.h"
#include "kerf/mesh/models.h"
#include "kerf/scene/body_scene.h"
#include "kerf/scene/closest_word.h"
#include "live_session.h"
#include "memory_body.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace kerf::python {
namespace {

SceneFrame frame_of(std::string_view name) {
  if (name == "rest") return SceneFrame::kRest;
  if (name == "world") return SceneFrame::kWorld;
  throw nb::value_error(("frame must be \"rest\" or \"world\", not \"" + std::string(name) + "\"").c_str());
}

/// One stroke; begins where `with` is entered.
class Stroke {
 public:
  Stroke(nb::object session, SceneFrame frame, bool through)
      : session_(std::move(session)), frame_(frame), through_(through) {}
  void enter() {
    if (number_ != 0) throw Failure(bad_input("this stroke has begun before; make another one"));
    number_ = live().begin_stroke(frame_, through_);
  }
  void move(nb::handle base, nb::handle tip) {
    const Vec3 from = point_of(base, "base"), to = point_of(tip, "tip");
    live().move_blade(number_, from, to);
  }
  void end() { live().end_stroke(number_, true); }
  void cancel() { live().end_stroke(number_, false); }
  /// What was cut stays, after an exception too. A stroke that is over already is none the worse for it.
  void exit(bool raised) {
    if (!live().closed()) {
      if (live().stroke_is_open(number_)) end();
    } else if (!raised) {
      throw Failure(bad_input("this session was closed within a stroke"));
    }
  }
  [[nodiscard]] bool is_open() { return !live().closed() && live().stroke_is_open(number_); }

  // For Python's collector: a session may hold its strokes.
  static int traverse(PyObject* self, visitproc visit, void* arg) {
    Py_VISIT(Py_TYPE(self));
    if (nb::inst_ready(self)) {
      const nb::handle session = nb::inst_ptr<Stroke>(self)->session_;
      Py_VISIT(session.ptr());
    }
    return 0;
  }
  static int clear(PyObject* self) {
    if (nb::inst_ready(self)) nb::inst_ptr<Stroke>(self)->session_.reset();
    return 0;
  }

 private:
  LiveSession& live() {
    if (!session_.is_valid()) throw Failure(bad_input("this stroke's session is gone"));  // the collector took it
    return nb::cast<LiveSession&>(session_);
  }
  nb::object session_;
  SceneFrame frame_;
  bool through_;
  std::uint64_t number_ = 0;
};

PyType_Slot stroke_slots[] = {{Py_tp_traverse, reinterpret_cast<void*>(&Stroke::traverse)},
                              {Py_tp_clear, reinterpret_cast<void*>(&Stroke::clear)},
                              {0, nullptr}};

/// For Python's collector: a session may hold the batch that it is in.
int traverse_batch(PyObject* self, visitproc visit, void* arg) {
  Py_VISIT(Py_TYPE(self));
  if (nb::inst_ready(self))
    for (const nb::object& session : nb::inst_ptr<Batch>(self)->sessions()) Py_VISIT(session.ptr());
  return 0;
}
int clear_batch(PyObject* self) {
  if (nb::inst_ready(self)) nb::inst_ptr<Batch>(self)->forget();
  return 0;
}
PyType_Slot batch_slots[] = {{Py_tp_traverse, reinterpret_cast<void*>(&traverse_batch)},
                             {Py_tp_clear, reinterpret_cast<void*>(&clear_batch)},
                             {0, nullptr}};

/// Rows for each session. The shapes are looked at in kerf/_batch.py.
using Numbers = nb::ndarray<const double, nb::c_contig, nb::device::cpu>;
using NumbersOut = nb::ndarray<double, nb::c_contig, nb::device::cpu>;
using Flags = nb::ndarray<const bool, nb::c_contig, nb::device::cpu>;
using NamedNumbers = std::vector<std::pair<std::string, Numbers>>;

const double* numbers_or_none(const nb::object& array, std::size_t wanted) {
  if (array.is_none()) return nullptr;
  const auto numbers = nb::cast<Numbers>(array);
  if (numbers.size() != wanted) throw nb::value_error("an array has the wrong size");
  return numbers.data();
}
const std::uint8_t* flags_or_none(const nb::object& array, std::size_t wanted) {
  if (array.is_none()) return nullptr;
  const auto flags = nb::cast<Flags>(array);
  if (flags.size() != wanted) throw nb::value_error("an array has the wrong size");
  return reinterpret_cast<const std::uint8_t*>(flags.data());
}

using Rows3 = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;

PictureView view_of(nb::handle eye, nb::handle target, nb::handle up, double field_of_view) {
  const PictureView view{point_of(eye, "eye"), point_of(target, "target"), point_of(up, "up"), field_of_view};
  if (const Status status = check_view(view); !status) throw nb::value_error(status.error().message.c_str());
  return view;
}

using Path = nb::ndarray<const double, nb::shape<-1, 2, 3>, nb::c_contig, nb::device::cpu>;

// --- Bodies ---

using Points = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Corners = nb::ndarray<const std::int32_t, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;

/// A surface as the package hands it over: the name of a file, or a pair of arrays that `name` then stands for; nothing where it is none.
void take_surface(nb::handle surface, const char* name, std::string& file, std::optional<TriangleMesh>& given) {
  if (surface.is_none()) return;
  if (nb::try_cast(surface, file)) return;
  const auto [points, corners] = nb::cast<std::pair<Points, Corners>>(surface);
  file = name;
  TriangleMesh& mesh = given.emplace();
  mesh.positions.reserve(points.shape(0));
  for (std::size_t i = 0; i < points.shape(0); ++i)
    mesh.positions.push_back({points.data()[3 * i], points.data()[3 * i + 1], points.data()[3 * i + 2]});
  mesh.triangles.reserve(corners.shape(0));
  for (std::size_t i = 0; i < corners.shape(0); ++i)
    mesh.triangles.push_back(
        {VertexId(corners.data()[3 * i]), VertexId(corners.data()[3 * i + 1]), VertexId(corners.data()[3 * i + 2])});
}

template <class T>
std::optional<T> option(const nb::dict& options, const char* key) {
  if (!options.contains(key)) return {};
  return nb::cast<T>(options[key]);
}

MemoryBody bind_body(nb::handle visual, nb::handle collision, const nb::dict& options, nb::dict judgement) {
  BodyRequest request;
  request.judgement = std::move(judgement);
  request.body.model = option<std::string>(options, "model").value_or("");
  take_surface(visual, "the mesh", request.body.visual, request.given.visual);
  take_surface(collision, "the collision mesh", request.body.collision, request.given.collision);
  request.body.options.collision_triangles = option<std::size_t>(options, "collision_triangles").value_or(0);
  request.body.scale = option<double>(options, "scale").value_or(1);
  request.body.thickness = option<double>(options, "thickness");
  request.body.exact_paths = option<bool>(options, "exact_paths").value_or(false);
  request.nature.young = option<double>(options, "young");
  request.nature.poisson = option<double>(options, "poisson");
  request.nature.density = option<double>(options, "density");
  return MemoryBody::bind(std::move(request));
}

}  // namespace
}  // namespace kerf::python

NB_MODULE(_core, m) {
  using namespace kerf;
  using namespace kerf::python;
  m.doc() = "The extension of the package kerf";
  translate_failures();

  nb::class_<Snapshot>(m, "Snapshot", "A state of one session, to go back to with its restore().");

  nb::class_<Stroke>(m, "Stroke", nb::type_slots(stroke_slots),
                     R"(One stroke of a blade: a context manager, made by Session.stroke().

It begins where `with` is entered and ends with the block, after an exception too. What it has cut is one step of undo().
A stroke that undo(), restore() or a blade of the scene ended is over; its blade then raises kerf.Error.)")
      .def(
          "__enter__",
          [](nb::handle_t<Stroke> self) {
            nb::cast<Stroke&>(self).enter();
            return nb::borrow(self);
          },
          nb::sig("def __enter__(self) -> Stroke"),
          "Begins the stroke. kerf.Error: another one is open, or this one has begun before.")
      .def(
          "__exit__", [](Stroke& self, nb::handle type, nb::handle, nb::handle) { self.exit(!type.is_none()); },
          nb::arg("type").none(), nb::arg("value").none(), nb::arg("traceback").none())
      .def("move", &Stroke::move, "base"_a, "tip"_a,
           nb::sig("def move(self, base: numpy.typing.ArrayLike, tip: numpy.typing.ArrayLike) -> None"),
           R"(Moves the blade's edge in a straight line to these ends; cuts at once.

base, tip: three finite numbers each, metres, in the stroke's frame. The first move only places the edge.
TypeError, ValueError: something else. kerf.Error: the stroke is over, or the edge has no length.)")
      .def("end", &Stroke::end, "Lifts the blade before the block ends. kerf.Error: the stroke is over.")
      .def("cancel", &Stroke::cancel,
           "Takes the stroke back: shape, positions and velocities are as it began. kerf.Error: the stroke is over.")
      .def_prop_ro("is_open", &Stroke::is_open, "Has it begun, and not ended?");

  nb::class_<MemoryBody>(
      m, "Body", R"(A body that is bound and can be cut: of kerf.bind() or kerf.load(), for kerf.Session and save().

It never changes, and any number of sessions in any threads may have it. Lengths are metres. Arrays are read-only.)")
      .def(
          "save",
          [](const MemoryBody& self, nb::handle path) {
            self.save(nb::cast<std::string>(nb::module_::import_("kerf._body").attr("path_text")(path)));
          },
          "path"_a, nb::sig("def save(self, path: str | os.PathLike[str]) -> None"),
          R"(Writes it to a file as `kerf bind` does, usually .kerf: the file appears complete and lasts, or not at all.

An existing file is replaced, but none that the body was made from. kerf.Error: that, or it can't be written.)")
      .def("_scene_text", &MemoryBody::scene_text, "name"_a)
      .def("__repr__",
           [](const MemoryBody& self) {
             const CellComplex& complex = self.loaded()->bound.complex;
             return "<kerf.Body, " + std::to_string(complex.visual.face_count()) + " triangles bound to " +
                    std::to_string(complex.collision.face_count()) + ">";
           })
      .def_prop_ro("closed", &MemoryBody::closed, "Has it two sides? Else it is an open sheet.")
      .def_prop_ro("notes", &MemoryBody::notes, "Repairs and warnings, in sentences.")
      .def_prop_ro(
          "diagnosis", &MemoryBody::diagnosis,
          nb::for_getter(nb::sig("def diagnosis(self) -> dict[str, typing.Any] | None")),
          R"(How the collision mesh was judged that kerf.bind() made: a dict; None where it made none, or where the body was loaded.

thinness ("thin", "doubtful" or "not thin"), reasons, warnings and notes (sentences), places (dicts of point and what), width_over_thickness,
narrow_share, narrowest, volume_ratio, branch_length, one_sided; quality: a dict of what `kerf bind` prints, metres and radians; collision: the mesh
that was made, as arrays vertices and triangles, also where it does not bind; surface: what `kerf bind --diagnose` saves, as arrays vertices, triangles, side, confidence, thickness and flag, the last four one for each triangle.)")
      .def_prop_ro(
          "vertices", &MemoryBody::vertices,
          nb::for_getter(nb::sig("def vertices(self) -> numpy.typing.NDArray[numpy.float64]")),
          "Visual vertices, metres: (n, 3), float64. Those that were given and used come first, those at one place as one.")
      .def_prop_ro("triangles", &MemoryBody::triangles,
                   nb::for_getter(nb::sig("def triangles(self) -> numpy.typing.NDArray[numpy.int32]")),
                   "Visual vertices of each triangle: (m, 3), int32.")
      .def_prop_ro("collision_vertices", &MemoryBody::collision_vertices,
                   nb::for_getter(nb::sig("def collision_vertices(self) -> numpy.typing.NDArray[numpy.float64]")),
                   "Collision vertices, metres: (n, 3), float64.")
      .def_prop_ro("collision_triangles", &MemoryBody::collision_triangles,
                   nb::for_getter(nb::sig("def collision_triangles(self) -> numpy.typing.NDArray[numpy.int32]")),
                   "Collision vertices of each triangle: (m, 3), int32.");

  nb::class_<HeldRecording>(m, "HeldRecording", "What a kerf.Recording holds.")
      .def("save", &HeldRecording::save, "file"_a)
      .def("changes", &HeldRecording::changes, nb::sig("def changes(self) -> list[dict[str, typing.Any]]"))
      .def("compare", &HeldRecording::compare, "other"_a,
           nb::sig("def compare(self, other: HeldRecording) -> dict[str, typing.Any]"))
      .def("title_and_step", &HeldRecording::title_and_step, "meshes"_a)
      .def_prop_ro("file", &HeldRecording::file)
      .def_prop_ro("name", [](const HeldRecording& self) { return self.recording()->source.name; })
      .def_prop_ro("scene", [](const HeldRecording& self) { return self.recording()->source.text; })
      .def_prop_ro("instructions", [](const HeldRecording& self) { return self.recording()->instructions; })
      .def_prop_ro("steps", [](const HeldRecording& self) { return self.recording()->last_step; });

  nb::class_<LiveSession>(m, "Session")
      .def(nb::init<const std::string&, const std::string&, const std::string&, const std::vector<std::string>&,
                    const nb::dict&, bool>(),
           "text"_a, "name"_a, "folder"_a, "meshes"_a, "bodies"_a, "record"_a)
      .def(nb::init<const HeldRecording&, const std::vector<std::string>&>(), "recording"_a, "meshes"_a)
      .def("_recording", &LiveSession::recording)
      .def("step", &LiveSession::step, "n"_a = 1, R"(Simulates n time steps of time_step seconds each.

Ctrl-C ends it after a whole step. ValueError: n is negative. kerf.Error: a step can't be done; the body is as before that step.)")
      .def("undo", &LiveSession::undo, "Takes the last stroke back, to the bit. kerf.Error: there is none.")
      .def("redo", &LiveSession::redo, "Does the stroke again that was undone last. kerf.Error: there is none.")
      .def("validate", &LiveSession::validate, "Checks all invariants; kerf.Error names the first that does not hold.")
      .def("close", &LiveSession::close,
           "Frees the session now; all else then raises kerf.Error. Arrays that came from it stay.")
      .def("snapshot", &LiveSession::snapshot, "The complete state, undo steps included.")
      .def("restore", &LiveSession::restore, "snapshot"_a, R"(Goes back to a snapshot of this session, to the bit.

A stroke() that was open then ends; a blade of the scene goes on. kerf.Error: the snapshot is of another session.)")
      .def(
          "stroke",
          [](nb::handle_t<LiveSession> self, std::string_view frame, bool through) {
            if (!nb::inst_ready(self))
              throw nb::type_error("this session was not made: its class does not call kerf.Session.__init__");
            return Stroke(nb::borrow(self), frame_of(frame), through);
          },
          "frame"_a = "rest", "through"_a = false, R"(A stroke of a blade, for `with`.

frame: its poses are in coordinates at rest ("rest") or where the body is now ("world").
through: cut every layer that the edge meets, not only the first. ValueError: another frame.)")
      .def(
          "_cut",
          [](LiveSession& self, const Path& poses, std::string_view frame, bool through) {
            return self.cut(poses.data(), poses.shape(0), frame_of(frame), through);
          },
          "poses"_a, "frame"_a, "through"_a)
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
              const nb::gil_scoped_release release;
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
              const nb::gil_scoped_release release;
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
          [](LiveSession& self, int width, int height, const nb::object& camera, bool depth, bool shadows) {
            std::optional<PictureView> view;
            if (!camera.is_none())
              view = view_of(camera.attr("eye"), camera.attr("target"), camera.attr("up"),
                             nb::cast<double>(camera.attr("field_of_view")));
            return self.render(width, height, view, depth, shadows);
          },
          "width"_a, "height"_a, "camera"_a.none(), "depth"_a, "shadows"_a,
          nb::sig(
              "def _render(self, width: int, height: int, camera: object, depth: bool, shadows: bool) -> typing.Any"))
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

  nb::class_<Play>(m, "Play", "What a kerf.Playback plays with.")
      .def(nb::init<const HeldRecording&>(), "recording"_a)
      .def("to", &Play::to, "session"_a, "step"_a)
      .def("report", &Play::report, nb::sig("def report(self) -> dict[str, typing.Any]"))
      .def_prop_ro("steps", &Play::steps)
      .def_prop_ro("over", &Play::over);

  nb::class_<Batch>(m, "Batch", nb::type_slots(batch_slots))
      .def(nb::init<std::vector<nb::object>, int>(), "sessions"_a, "threads"_a)
      .def("__len__", &Batch::size)
      .def_prop_ro("threads", &Batch::threads, "Threads that take the turns, the caller's included.")
      .def(
          "_turn",
          [](Batch& self, std::int64_t steps, const nb::object& edges, const nb::object& cuts, const nb::object& takes,
             const NamedNumbers& grasps, const NamedNumbers& tools) {
            BatchTurn turn;
            turn.steps = steps;
            turn.edges = numbers_or_none(edges, 6 * self.size());
            turn.cuts = flags_or_none(cuts, self.size());
            turn.takes = flags_or_none(takes, self.size());
            for (const auto& [id, targets] : grasps) {
              if (targets.size() != 3 * self.size()) throw nb::value_error("an array has the wrong size");
              turn.grasps.emplace_back(id, targets.data());
            }
            for (const auto& [id, poses] : tools) {
              if (poses.size() != 6 * self.size()) throw nb::value_error("an array has the wrong size");
              turn.tools.emplace_back(id, poses.data());
            }
            return self.turn(turn);
          },
          "steps"_a, "edges"_a.none(), "cuts"_a.none(), "takes"_a.none(), "grasps"_a, "tools"_a)
      .def(
          "_place_blade",
          [](Batch& self, std::size_t session, nb::handle base, nb::handle tip) {
            self.place_blade(session, point_of(base, "base"), point_of(tip, "tip"));
          },
          "session"_a, "base"_a, "tip"_a)
      .def(
          "_to_world",
          [](Batch& self, const Numbers& rest, const NumbersOut& now) {
            if (rest.size() != now.size() || self.size() == 0 || rest.size() % (3 * self.size()) != 0)
              throw nb::value_error("an array has the wrong size");
            self.places_now(rest.data(), rest.size() / (3 * self.size()), now.data());
          },
          "rest"_a, "now"_a)
      .def(
          "_to_rest",
          [](Batch& self, const Numbers& now, const NumbersOut& rest, const NumbersOut& distance) {
            if (rest.size() != now.size() || 3 * distance.size() != now.size() || self.size() == 0 ||
                rest.size() % (3 * self.size()) != 0)
              throw nb::value_error("an array has the wrong size");
            self.places_at_rest(now.data(), now.size() / (3 * self.size()), rest.data(), distance.data());
          },
          "now"_a, "rest"_a, "distance"_a);

  m.def(
      "check_camera",
      [](nb::handle eye, nb::handle target, nb::handle up, double field_of_view) {
        view_of(eye, target, up, field_of_view);
      },
      "eye"_a, "target"_a, "up"_a, "field_of_view"_a);

  m.def("read_recording", &HeldRecording::load, "file"_a);
  m.def("bind_body", &bind_body, "visual"_a.none(), "collision"_a.none(), "options"_a, "judgement"_a);
  m.def("load_body", &MemoryBody::load, "file"_a);
  m.def("model_names", [] {
    std::vector<std::string> out;
    for (const ModelName& model : model_names()) out.emplace_back(model.name);
    return out;
  });
  m.def(
      "scene_text",
      [](const std::string& file) {
        const std::string text = value_of(scene_text_in(file));
        return nb::bytes(text.data(), text.size());
      },
      "file"_a);
  m.def(
      "closest_word",
      [](const std::string& word, const std::vector<std::string>& known) {
        const std::vector<std::string_view> views(known.begin(), known.end());
        return std::string(closest_word(word, views));
      },
      "word"_a, "known"_a);
}
