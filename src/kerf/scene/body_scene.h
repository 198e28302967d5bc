// A scene for a bound body alone, so that nothing else need be said to run or see it.
#pragma once

#include <filesystem>
#include <string>

#include "kerf/base/result.h"

namespace kerf {

struct CellComplex;

/// Without supports in the scene, "the far rim" is this share of the body's length along y.
inline constexpr double kRimShare = 0.15;

/// The text of a scene in which a body saved by kerf bind hangs by its far rim. It names the file without its folder. Errors:
/// as of load_bound_body.
Result<std::string> body_scene_text(const std::string& title, const std::filesystem::path& bound_body);

/// The same for a body that a program has, by the name that stands for it (SceneFolders::bodies).
std::string body_scene_text(const std::string& title, const std::string& name, const CellComplex& body);

/// By its ending, .kerf.
bool is_bound_body(const std::filesystem::path& file);

/// The text of a scene file, or of the scene of a bound body.
Result<std::string> scene_text_in(const std::filesystem::path& file);

/// The end of such a scene, and of that of uploaded meshes: how a body hangs that reaches from one y to the other (metres).
std::string far_rim_text(double least_y, double most_y);

}  // namespace kerf
