#include "kerf/scene/scene_place.h"

#include <fmt/format.h>

#include "kerf/base/shown_text.h"

namespace kerf {

std::string scene_place(const Scene& scene, int line) {
  return line > 0 ? fmt::format("{}:{}: ", shown(scene.file.empty() ? scene.name : scene.file), line) : std::string();
}

Error at_line(const Scene& scene, int line, Error error) {
  error.message = scene_place(scene, line) + error.message;
  return error;
}

}  // namespace kerf
