#include "kerf/scene/body_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kerf/binding/bound_body_file.h"
#include "kerf/mesh/whole_file.h"

namespace kerf {
namespace {

constexpr double kTimeStep = 0.005;  ///< s

/// A TOML string.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? '_' : c;
  }
  return out + '"';
}

}  // namespace

bool is_bound_body(const std::filesystem::path& file) { return file.extension() == ".kerf"; }

std::string far_rim_text(double least_y, double most_y) {
  return fmt::format(
      "[simulation]\ntime_step = {}\n[[fix]]\nhalf_space = {{ point = [0, {}, 0], normal = [0, 1, 0] }}\n", kTimeStep,
      most_y - kRimShare * (most_y - least_y));
}

Result<std::string> scene_text_in(const std::filesystem::path& file) {
  if (is_bound_body(file)) return body_scene_text(file.stem().string(), file);
  const auto text = read_whole_file(file.string(), kSceneFile);
  if (!text) return text.error();
  return std::string(text->view());
}

Result<std::string> body_scene_text(const std::string& title, const std::filesystem::path& bound_body) {
  const auto body = load_bound_body(bound_body);
  if (!body) return body.error();
  return body_scene_text(title, bound_body.filename().string(), body->complex);
}

std::string body_scene_text(const std::string& title, const std::string& name, const CellComplex& body) {
  double least = HUGE_VAL, most = -HUGE_VAL;
  for (const Vec3 p : body.collision.rest.raw()) {
    least = std::min(least, p.y);
    most = std::max(most, p.y);
  }
  return fmt::format("title = {}\n[body]\nbound = {}\n", quoted(title), quoted(name)) + far_rim_text(least, most);
}

}  // namespace kerf
