// libFuzzer: scenes from anywhere are read or refused with a message that names the file, and the same text gives the same answer.
#include <cmath>
#include <cstdlib>
#include <string_view>

#include "kerf/scene/scene_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto scene = kerf::parse_scene(text, "fuzz", "/nonexistent");
  const auto again = kerf::parse_scene(text, "fuzz", "/nonexistent");
  if (scene.ok() != again.ok()) std::abort();
  if (!scene) {
    if (scene.error().message != again.error().message || scene.error().message.find("fuzz") == std::string::npos)
      std::abort();
    return 0;
  }
  const auto& s = scene->simulation;
  if (!(s.time_step > 0) || !std::isfinite(s.duration) || !kerf::is_finite(s.gravity)) std::abort();
  double before = 0;
  for (const auto& command : scene->commands) {
    if (!(command.at >= before)) std::abort();
    before = command.at;
  }
  return 0;
}
