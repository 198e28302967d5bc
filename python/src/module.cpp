// The extension module kerf._core. What stands in python/kerf/*.py makes it comfortable.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <string>
#include <string_view>
#include <vector>

#include "define.h"
#include "errors.h"
#include "kerf/mesh/models.h"
#include "kerf/scene/body_scene.h"
#include "kerf/scene/closest_word.h"
#include "kerf/scene/scene_file.h"
#include "python_lock.h"

namespace nb = nanobind;
using namespace nb::literals;

NB_MODULE(_core, m) {
  using namespace kerf;
  using namespace kerf::python;
  m.doc() = "The extension of the package kerf";
  translate_failures();
  watch_pythons_end();
#ifdef NDEBUG
  nb::set_leak_warnings(false);  // what a daemon thread had when Python ended is no leak of anybody's
#endif
  define_strokes(m);
  define_bodies(m);
  define_recordings(m);
  define_sessions(m);
  define_plays(m);
  define_batches(m);

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
      "scene_opens", [](const std::string& file) { return read_scene(file).ok(); }, "file"_a);
  m.def(
      "closest_word",
      [](const std::string& word, const std::vector<std::string>& known) {
        const std::vector<std::string_view> views(known.begin(), known.end());
        return std::string(closest_word(word, views));
      },
      "word"_a, "known"_a);
}
