// Keeping the hexahedra in step with the collision mesh (4.2.1): branch analysis, node sharing, absorption, material.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "kerf/lattice/hex_mesh.h"

namespace kerf {

/// What adapting changed. Parents and hosts are in the HexMesh.
struct LatticeChange {
  /// A share of a node's material that another node carried before. volume: in cells.
  struct NodeOrigin {
    NodeId node, from;
    double volume = 0;
  };
  std::vector<HexId> new_copies;  ///< ascending; HexMesh::parent says whose rotation they inherit
  std::vector<HexId> dead_copies;
  std::vector<HexId> changed_copies;  ///< other copies with new nodes, material, state or mass
  std::vector<NodeId> new_nodes;      ///< ascending; HexMesh::node_parent says whose position and velocity they inherit
  /// Nodes that carry material of more than one old node: what came apart ahead of a tip and is one again. Shares by node.
  std::vector<NodeOrigin> joined_nodes;
  std::vector<NodeId> switched_nodes;  ///< other nodes that got their first use or lost their last
  std::vector<CollisionTriangle>
      triangles;              ///< ascending: the changed ones and all others whose material is in another
                              ///< copy or host than before: embed_triangles has to look at what they own
  bool tips_changed = false;  ///< tip_glue has to be asked again
  void clear();
};

/// Memory that adapting keeps between calls. A copy starts with memory of its own.
class LatticeScratch {
 public:
  LatticeScratch();
  ~LatticeScratch();
  LatticeScratch(const LatticeScratch&);
  LatticeScratch(LatticeScratch&&) noexcept;
  LatticeScratch& operator=(LatticeScratch) noexcept;

  struct Work;
  std::unique_ptr<Work> work;  ///< private to the implementation
};

/// Brings `hex` up to date after a cut. `changed`: every triangle that is new, has other corners or vertices than before, or has an
/// edge that was cut or joined (any order, repeats allowed); changed_triangles collects them from the
/// mesh's journal. Looks only at the cells of these triangles and one ring further, and gives what
/// build_lattice would give for the mesh as it is now, but keeps the ids of copies and nodes that are still there;
/// of two copies made out of one, the left side of the cut keeps the id. Cost: proportional to the changed triangles.
void adapt_lattice(const CollisionMesh& mesh, HexMesh& hex, std::span<const CollisionTriangle> changed,
                   LatticeScratch& scratch, LatticeChange& change);

/// The marks of the arrays of a collision mesh that say which triangles changed.
struct CollisionMark {
  Journaled<CollisionHalfEdge, CollisionVertex>::Mark origin;
  Journaled<CollisionHalfEdge, CollisionHalfEdge>::Mark twin;
};
/// Triangles written to or appended since the mark, ascending, each once.
void changed_triangles(const CollisionMesh& mesh, const CollisionMark& since, std::vector<CollisionTriangle>& out);

}  // namespace kerf
