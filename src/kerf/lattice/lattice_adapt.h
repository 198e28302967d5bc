// Keeping the hexahedra in step with the collision mesh (4.2.1): branch analysis, node sharing, absorption, material.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kerf/lattice/hex_mesh.h"

namespace kerf {

/// What adapting changed. Parents and hosts are in the HexMesh.
struct LatticeChange {
  std::vector<HexId> new_copies;        ///< ascending; HexMesh::parent says whose rotation they inherit
  std::vector<HexId> dead_copies;
  std::vector<HexId> changed_copies;    ///< other copies with new nodes, material, state or mass
  std::vector<NodeId> new_nodes;        ///< ascending; HexMesh::node_parent says whose position and velocity they inherit
  std::vector<NodeId> switched_nodes;   ///< other nodes that got their first use or lost their last
  std::vector<CollisionTriangle> triangles;  ///< ascending: their points may have to move to another copy
  bool tips_changed = false;            ///< tip_glue has to be asked again
  void clear();
};

/// Memory that adapting keeps between calls; contents are private to it.
struct LatticeScratch {
  struct NewPiece { CollisionTriangle triangle; CellId cell; double volume; };
  struct OldPiece { CellId cell; CollisionTriangle triangle; HexId copy; TipId tip; std::int32_t side; Vec3 point, normal; RootId root; std::array<Vec2, 3> planar; };
  struct Element {
    CollisionTriangle triangle;
    TipId tip;
    std::int32_t side = 0;
    double volume = 0;
    HexId old_copy, copy;
    std::int32_t moments = -1;  ///< in `moments`
    PieceIndex piece;           ///< where it was, if its triangle kept its shape
    std::array<std::int8_t, 3> edge_side{};  ///< of a split prism: which side an edge is on, 0 crossed
    std::int32_t root = 0;      ///< union-find
  };
  struct CellElements { CellId cell; std::int32_t first = 0, count = 0; bool touched = false; };
  struct Result { CollisionTriangle triangle; CellId cell; std::int32_t element; };

  std::vector<CollisionTriangle> reshaped;
  std::vector<CollisionVertex> vertices;
  std::vector<CellId> touched;
  std::vector<NewPiece> new_pieces;
  std::vector<OldPiece> old_pieces;
  std::vector<Element> elements;
  std::vector<Moments> moments;
  std::vector<CellElements> cells;
  std::vector<Result> results;
  std::vector<CellVolume> volumes;
  std::vector<double> box;
  std::vector<std::uint64_t> triangle_stamp, cell_stamp, cell_cached, hex_stamp;  ///< per element: serial of the last visit
  std::vector<std::int32_t> triangle_slot, cell_slot;
  std::uint64_t serial = 0;
  std::vector<std::array<std::int32_t, 2>> queue;
  std::vector<HexLink> links;
  std::vector<LatticeFaceId> faces;
  std::vector<std::int32_t> corners;
  std::vector<std::pair<std::int32_t, NodeId>> corner_nodes;
  std::vector<HexId> small, dirty, hosts, stack, neighbours;
  std::vector<Piece> run;
  std::vector<Moments> run_moments;
  std::vector<std::int32_t> parent, wanted;
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
