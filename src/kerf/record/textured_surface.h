// The drawn surface with texture coordinates per vertex, for formats that want them there (glTF): render vertices on a
// texture seam are doubled.
#pragma once

#include <array>
#include <vector>

#include "kerf/session/render_surface.h"

namespace kerf {

struct TexturedSurface {
  std::vector<RenderVertex> vertex;  ///< where each vertex comes from
  std::vector<Vec2f> texture;
  std::vector<std::array<std::int32_t, 3>> skin, walls;  ///< counter-clockwise from outside
};

/// Cost: n log n in the number of visual triangles.
TexturedSurface textured_surface(const RenderSurface& surface, const VisualMesh& mesh);

}  // namespace kerf
