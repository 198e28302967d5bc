#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "define.h"
#include "kerf/mesh/polygon_faces.h"
#include "memory_body.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace kerf::python {
namespace {

using Points = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Corners = nb::ndarray<const std::int32_t, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Texture = nb::ndarray<const float, nb::shape<-1, 3, 2>, nb::c_contig, nb::device::cpu>;
using Polygons = nb::ndarray<const std::int64_t, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu>;

/// A surface as the package hands it over (_meshes.py): the name of a file, or arrays that `name` then stands for; nothing where it is none.
void take_surface(nb::handle surface, const char* name, std::string& file, std::optional<TriangleMesh>& given) {
  if (surface.is_none()) return;
  if (nb::try_cast(surface.attr("file"), file)) return;
  const auto points = nb::cast<Points>(surface.attr("points"));
  const auto corners = nb::cast<Corners>(surface.attr("triangles"));
  file = name;
  TriangleMesh& mesh = given.emplace();
  mesh.positions.reserve(points.shape(0));
  for (std::size_t i = 0; i < points.shape(0); ++i)
    mesh.positions.push_back({points.data()[3 * i], points.data()[3 * i + 1], points.data()[3 * i + 2]});
  mesh.triangles.reserve(corners.shape(0));
  for (std::size_t i = 0; i < corners.shape(0); ++i)
    mesh.triangles.push_back(
        {VertexId(corners.data()[3 * i]), VertexId(corners.data()[3 * i + 1]), VertexId(corners.data()[3 * i + 2])});
  if (const nb::object texture = surface.attr("texture"); !texture.is_none()) {
    const auto uv = nb::cast<Texture>(texture);
    mesh.texture.resize(uv.shape(0));
    for (std::size_t i = 0; i < uv.size() / 2; ++i)
      mesh.texture.raw()[i / 3][i % 3] = {uv.data()[2 * i], uv.data()[2 * i + 1]};
  }
  if (const nb::object faces = surface.attr("polygons"); !faces.is_none()) {
    const auto rows = nb::cast<Polygons>(faces);
    std::vector<PolygonFace> polygons;
    for (std::size_t i = 0; i < rows.shape(0); ++i)
      polygons.push_back(
          {static_cast<std::size_t>(rows.data()[2 * i]), static_cast<std::size_t>(rows.data()[2 * i + 1]), i});
    if (const PolygonFace* late = fit_polygon_faces(polygons, mesh))
      throw nb::value_error(too_many_corners(*late).c_str());
  }
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
  request.body.weld = option<double>(options, "weld");
  request.body.exact_paths = option<bool>(options, "exact_paths").value_or(false);
  request.nature.young = option<double>(options, "young");
  request.nature.poisson = option<double>(options, "poisson");
  request.nature.density = option<double>(options, "density");
  return MemoryBody::bind(std::move(request));
}

}  // namespace

void define_bodies(nb::module_& m) {
  nb::class_<MemoryBody> body(
      m, "Body", R"(A body that is bound and can be cut: of kerf.bind() or kerf.load(), for kerf.Session and save().

It never changes, and any number of sessions in any threads may have it. Lengths are metres. Arrays are read-only.
It can be pickled, for other processes, with all but its diagnosis and notes.)");
  copy_is_itself(body, nb::sig("def __copy__(self) -> Body"),
                 nb::sig("def __deepcopy__(self, memo: typing.Any) -> Body"));
  body.def("__init__", refuse_to_make<MemoryBody>("a body comes from kerf.bind() or kerf.load()"), kRefusesToMake)
      .def(
          "save",
          [](const MemoryBody& self, nb::handle path) {
            self.save(nb::cast<std::string>(nb::module_::import_("kerf._paths").attr("path_text")(path)));
          },
          "path"_a.none(), nb::sig("def save(self, path: str | os.PathLike[str]) -> None"),
          R"(Writes it to a file as `kerf bind` does, usually .kerf: the file appears complete and lasts, or not at all.

An existing file is replaced, but none that the body was made from. kerf.Error: that, or it can't be written.)")
      .def(
          "__reduce_ex__",
          [](const MemoryBody& self, nb::handle) {
            return nb::make_tuple(nb::module_::import_("kerf._body").attr("unpickled"),
                                  nb::make_tuple(self.bytes(), self.title()));
          },
          "protocol"_a, nb::sig("def __reduce_ex__(self, protocol: typing.SupportsIndex, /) -> typing.Any"))
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
  m.def("bind_body", &bind_body, "visual"_a.none(), "collision"_a.none(), "options"_a, "judgement"_a);
  m.def("load_body", &MemoryBody::load, "file"_a);
  m.def("body_of_bytes", &MemoryBody::of_bytes, "data"_a, "title"_a);
}

}  // namespace kerf::python
