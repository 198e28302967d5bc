// How material moved in some cells, kept while the cells are made anew: a provisional tip is rolled back and walked again, and
// nodes that come back need not be the same ones, nor on the same side of the slit.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kerf/lattice/hex_mesh.h"
#include "kerf/session/node_fade.h"

namespace kerf {

struct NodeMemory {
  struct Copy {
    std::array<NodeMotion, 8> nodes;
  };
  struct Piece {
    CellId cell;
    CollisionTriangle triangle;
    std::int32_t side = 0;  ///< of a tip's continuation; 0: whole
    double volume = 0;
    std::int32_t copy = 0;  ///< in copies
  };
  /// How much of a remembered copy's material is in a copy of now.
  struct Heir {
    HexId copy;
    std::int32_t from = 0;  ///< in copies
    double volume = 0;
  };
  /// What a remembered node lends to a node of now.
  struct Share {
    NodeId node;
    double volume = 0;
    NodeMotion from;
  };
  std::vector<Copy> copies;
  std::vector<Piece> pieces;  ///< by cell and triangle
  std::vector<CellId> cells;  ///< ascending
  std::vector<Heir> heirs;    ///< memory of recall_cells
  std::vector<Share> shares;  ///< memory of recall_cells
  void clear();
  [[nodiscard]] bool empty() const { return pieces.empty(); }
};

/// Remembers the motion of all pieces of material in these cells (any order, repeats allowed), instead of what was remembered.
void remember_cells(const HexMesh& hex, const MechanicsState& state, const NodeFade& fade,
                    std::span<const CellId> cells, NodeMemory& memory);

/// Gives the nodes of those cells the motion and offsets that most of their material had, to the bit. Nodes of material that is not
/// remembered stay as they are. Appends the motion that nodes had before to `old`.
void recall_cells(const HexMesh& hex, const MechanicsModel& model, NodeMemory& memory, MechanicsState& state,
                  NodeFade& fade, std::vector<NodeMotion>& old);

/// Of shares of one node, sorted by the node they are from: the first of that node with the most volume.
const NodeMemory::Share& largest_share(std::span<const NodeMemory::Share> shares);

}  // namespace kerf
