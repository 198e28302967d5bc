// Taking the hexahedra of removed pieces away: copies, nodes and lists, with their memory.
#pragma once

#include "kerf/base/id_map.h"
#include "kerf/lattice/hex_mesh.h"

namespace kerf {

struct LatticeRenaming {
  IdMap<HexId> copy;
  IdMap<NodeId> node;
};

/// Brings `hex` to a collision mesh from which whole connected pieces were removed, with the maps of its ids. Copies with
/// material of what has gone go; so do dead copies and nodes that no copy names. What stays keeps its order. Cost: linear.
LatticeRenaming remove_from_lattice(HexMesh& hex, const IdMap<CollisionVertex>& vertex,
                                    const IdMap<CollisionHalfEdge>& half_edge, const IdMap<CollisionTriangle>& triangle,
                                    const CollisionMesh& mesh);

}  // namespace kerf
