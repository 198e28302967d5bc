#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "define.h"
#include "held_recording.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace kerf::python {

void define_recordings(nb::module_& m) {
  nb::class_<HeldRecording>(m, "HeldRecording", "What a kerf.Recording holds.")
      .def("save", &HeldRecording::save, "file"_a)
      .def("text", &HeldRecording::text)
      .def("changes", &HeldRecording::changes, nb::sig("def changes(self) -> list[dict[str, typing.Any]]"))
      .def("compare", &HeldRecording::compare, "other"_a,
           nb::sig("def compare(self, other: HeldRecording) -> dict[str, typing.Any]"))
      .def("title_and_step", &HeldRecording::title_and_step, "meshes"_a)
      .def_prop_ro("file", &HeldRecording::file)
      .def_prop_ro("name", [](const HeldRecording& self) { return self.recording()->source.name; })
      .def_prop_ro("scene", [](const HeldRecording& self) { return self.recording()->source.text; })
      .def_prop_ro("instructions", [](const HeldRecording& self) { return self.recording()->instructions; })
      .def_prop_ro("steps", [](const HeldRecording& self) { return self.recording()->last_step; });
  m.def("read_recording", &HeldRecording::load, "file"_a);
  m.def("recording_of_text", &HeldRecording::of_text, "text"_a, "file"_a);
}

void define_plays(nb::module_& m) {
  nb::class_<Play>(m, "Play", "What a kerf.Playback plays with.")
      .def(nb::init<const HeldRecording&>(), "recording"_a)
      .def("to", &Play::to, "session"_a, "step"_a)
      .def("report", &Play::report, nb::sig("def report(self) -> dict[str, typing.Any]"))
      .def_prop_ro("steps", &Play::steps)
      .def_prop_ro("over", &Play::over);
}

}  // namespace kerf::python
