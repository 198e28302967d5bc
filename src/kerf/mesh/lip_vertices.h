// Which vertices are lips of a slit, and which are its tips.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kerf/mesh/triangle_mesh.h"

namespace kerf {

/// |V| each, 0 or 1.
struct LipVertices {
  std::vector<std::uint8_t> lip;
  std::vector<std::uint8_t>
      tip;  ///< where both lips end: no lip, and what they are made of lies on itself there, or edges lead to two twins
};

/// Twins are lips: used vertices at one place. Lips may be divided differently: a vertex beside a lip is one too where it lies within kOnLip on a triangle
/// that faces its own. On a border it lies on an edge that runs the other way. `first`: of first_at_place (lips.h); `diagonal`: of the mesh, metres.
/// Empty without twins, in linear time; with them near n log n. Triangles have three different corners.
LipVertices find_lip_vertices(const TriangleMesh& mesh, std::span<const std::int32_t> first, double diagonal);

}  // namespace kerf
