// Generated surfaces of rigid obstacles: closed, counter-clockwise from outside.
#pragma once

#include <string_view>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/mesh/triangle_mesh.h"

namespace kerf {

struct RigidModelName {
  std::string_view name;
  std::string_view description;  ///< one line
};

/// The names that make_rigid_model() knows.
const std::vector<RigidModelName>& rigid_model_names();

/// Generates a surface, `scale` (> 0) times its size. Bad input: an unknown name, a scale that is not positive and finite.
Result<TriangleMesh> make_rigid_model(std::string_view name, double scale);

}  // namespace kerf
