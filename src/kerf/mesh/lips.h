// Lips: vertices that lie at one place and are apart all the same, as a cut that does not go through leaves them. Which they are: lip_vertices.h.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kerf/base/vec.h"
#include "kerf/mesh/triangle_mesh.h"

namespace kerf {

/// For every vertex the first one at its place; 0 and -0 are one place. Linear time.
std::vector<std::int32_t> first_at_place(std::span<const Vec3> positions);

/// |V|: what to add to each vertex so that lips lie apart; empty without twins. What searches by place then finds
/// one lip and not the other. Lips go back into their own material by kLipGap of the diagonal, less towards the tips of a slit, which
/// stay; the vertices around follow by less and less, so that no triangle turns over. Triangles have three different corners. Near linear time.
std::vector<Vec3> draw_lips_back(const TriangleMesh& mesh);

/// The mesh with its lips drawn back; a copy of it where it has none.
TriangleMesh with_lips_drawn_back(const TriangleMesh& mesh);

}  // namespace kerf
