#include "arrays.h"
#include "define.h"
#include "stroke.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace kerf::python {
namespace {

PyType_Slot stroke_slots[] = {{Py_tp_traverse, reinterpret_cast<void*>(&Stroke::traverse)},
                              {Py_tp_clear, reinterpret_cast<void*>(&Stroke::clear)},
                              {0, nullptr}};

}  // namespace

SceneFrame frame_of(nb::handle name) {
  if (PyUnicode_Check(name.ptr())) {
    if (PyUnicode_CompareWithASCIIString(name.ptr(), "rest") == 0) return SceneFrame::kRest;
    if (PyUnicode_CompareWithASCIIString(name.ptr(), "world") == 0) return SceneFrame::kWorld;
  }
  const Call call;
  nb::module_::import_("kerf._arguments").attr("refuse_frame")(name);
  throw nb::type_error("frame is something else");
}

void define_strokes(nb::module_& m) {
  nb::class_<Stroke>(m, "Stroke", nb::type_slots(stroke_slots),
                     R"(One stroke of a blade: a context manager, made by Session.stroke().

It begins where `with` is entered and ends with the block, after an exception too, or with the last name for it. What it has cut is one step of undo().
A stroke that undo(), restore() or a blade of the scene ended is over; its blade then raises kerf.Error. A session that is made with
scripted=False has no blades of the scene.)")
      .def("__init__", refuse_to_make<Stroke>("a stroke comes from stroke() of a kerf.Session"), kRefusesToMake)
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
      .def("move", &Stroke::move, "base"_a.none(), "tip"_a.none(),
           nb::sig("def move(self, base: numpy.typing.ArrayLike, tip: numpy.typing.ArrayLike) -> None"),
           R"(Moves the blade's edge in a straight line to these ends; cuts at once.

base, tip: three finite numbers each, metres, in the stroke's frame. The first move only places the edge.
TypeError, ValueError: something else. kerf.Error: the stroke is over, or the edge has no length.)")
      .def("end", &Stroke::end, "Lifts the blade before the block ends. kerf.Error: the stroke is over.")
      .def("cancel", &Stroke::cancel,
           "Takes the stroke back: shape, positions and velocities are as it began. kerf.Error: the stroke is over.")
      .def(
          "__reduce_ex__",
          [](const Stroke&, nb::handle) {
            throw nb::type_error("a stroke can't be copied or pickled; begin another one with stroke() of its session");
          },
          "protocol"_a, nb::sig("def __reduce_ex__(self, protocol: typing.SupportsIndex, /) -> typing.Any"))
      .def_prop_ro("is_open", &Stroke::is_open, "Has it begun, and not ended?");
}

}  // namespace kerf::python
