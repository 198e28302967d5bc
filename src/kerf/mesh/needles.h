// Vertices that stick out of a surface like needles: stray ones, put far off by a fault of a file.
//
//             far vertex
//             /|
//            / |          all its triangles are narrow there:
//           / |           their angles together are under kNeedle
//          / |
//   -------  --------
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kerf/mesh/triangle_mesh.h"

namespace kerf {

/// In rising order, of vertices with triangles all round; place[v]: the first vertex at the place of v. Linear.
std::vector<VertexId> find_needles(const TriangleMesh& mesh, std::span<const std::int32_t> place);

}  // namespace kerf
