// A plain triangle surface: what files hold and generators make.
#pragma once

#include <array>
#include <vector>

#include "kerf/base/ids.h"
#include "kerf/base/indexed.h"
#include "kerf/base/vec.h"

namespace kerf {

struct TriangleMesh {
  IndexedArray<VertexId, Vec3> positions;                       ///< |V| x 3, metres
  IndexedArray<TriangleId, std::array<VertexId, 3>> triangles;  ///< |F| x 3, counter-clockwise from outside
  IndexedArray<TriangleId, std::array<Vec2f, 3>> texture;       ///< |F| x 3 corners, or empty: no UVs
  IndexedArray<TriangleId, std::int32_t> group;                 ///< |F| material group, or empty: all 0

  [[nodiscard]] bool has_texture() const { return !texture.empty(); }
};

}  // namespace kerf
