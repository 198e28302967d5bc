// The shape of a wall: where its vertices are, and where they would be if the wall were smooth.
//
// The smooth wall is ruled: straight lines across the thickness between the chains of its border edge. Roughness is how
// far the vertices stray from it, outwards (paper 5.3, figure 24).
#pragma once

#include <vector>

#include "kerf/binding/cell_complex.h"

namespace kerf {

struct WallPoint {
  VisualVertex vertex;
  double along = 0;      ///< column in the wall's plane
  double across = 0;     ///< 0 at the + chain, 1 at the - chain
  Vec3 top, bottom;      ///< metres: ends of the ruled surface's straight line there
  Vec3 smooth;           ///< metres: where the ruled surface has it, between top and bottom by `across`
  bool on_line = false;  ///< of an end of the border edge: shared with the wall beyond
};

/// All vertices of a wall but those on its chains: inner ones, and those of the lines at both ends.
void wall_points(const CellComplex& body, WallId wall, std::vector<WallPoint>& out);

/// Unit vector away from the material, in the mid-surface and across the border edge of a wall.
Vec3 wall_outward(const CollisionMesh& mesh, CollisionHalfEdge border);

/// The walls that face nothing: those of a slit face each other, to the bit, until one side is shaved or taken away. What is taken out
/// leaves bare walls.
///
///   a slit    ───────────        a hole    ┌──────┐
///             ───────────                  │ gone │  bare all around
///             neither bare                 └──────┘
std::vector<WallId> bare_walls(const CellComplex& body);

/// Root mean square distance (metres) of the vertices of these walls from the smooth walls; 0 for none.
double wall_roughness(const CellComplex& body, const std::vector<WallId>& walls);

}  // namespace kerf
