// Where something stands in a scene file, for messages.
#pragma once

#include <string>

#include "kerf/base/result.h"
#include "kerf/scene/scene.h"

namespace kerf {

/// "file:line: "; empty for line 0, of what no file says.
std::string scene_place(const Scene& scene, int line);
/// Puts that before a message.
Error at_line(const Scene& scene, int line, Error error);

}  // namespace kerf
