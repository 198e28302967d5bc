// Does material go over an edge between two steps, and how does it move there?
#pragma once

#include <optional>
#include <vector>

#include "kerf/cutting/blade_sweep.h"
#include "kerf/binding/cell_complex.h"

namespace kerf {

/// Mean motion, in metres, of the places of the middle surface that have crossed an edge, while vertices went straight from `before` to `after`
/// and the edge from `from` to `to`. None where nothing has crossed it. `spacing`: of the points of the edge that are looked at, metres.
std::optional<Vec3> motion_over_edge(const CollisionMesh& mesh, const std::vector<Vec3>& before, const std::vector<Vec3>& after,
                                     const BladeEdge& from, const BladeEdge& to, double spacing);

}  // namespace kerf
