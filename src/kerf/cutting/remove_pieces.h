// Taking loose pieces away (paper 5.3): collision mesh, visual mesh and walls of a piece go, with their memory.
//
// What stays keeps its order and gets new ids, so arrays have no holes and nobody has to skip the dead.
#pragma once

#include "kerf/base/id_map.h"
#include "kerf/binding/cell_complex.h"
#include "kerf/cutting/validate.h"

namespace kerf {

struct ComplexRenaming {
  IdMap<CollisionVertex> collision_vertex;
  IdMap<CollisionHalfEdge> collision_half_edge;
  IdMap<CollisionTriangle> collision_triangle;
  IdMap<VisualVertex> visual_vertex;
  IdMap<VisualHalfEdge> visual_half_edge;
  IdMap<VisualTriangle> visual_triangle;
  IdMap<WallId> wall;
  /// New ids of vertices that were split off from one that has gone: the first of those twins that stays stands for it, so their
  /// order among others may be another than before.
  std::vector<CollisionVertex> new_ancestor;
  ComplexMeasures removed;  ///< area of skin and of collision mesh, enclosed volume of what has gone
};

/// Removes the collision triangles with remove[f] != 0 and everything that they own. They must be whole connected pieces,
/// and not all there are. The journal's marks don't hold any more. Cost: linear in the body.
ComplexRenaming remove_pieces(CellComplex& body, const std::vector<std::uint8_t>& remove);

}  // namespace kerf
