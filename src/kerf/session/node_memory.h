// How material moved in some cells, kept while the cells are made anew: a provisional tip is rolled back and walked again, and
// nodes that come back need not be the same ones, nor on the same side of the slit.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kerf/lattice/hex_mesh.h"
#include "kerf/mechanics/step.h"

namespace kerf {

/// Where a node was and how it moved, metres and m/s.
struct NodeMotion {
  NodeId node;
  Vec3 position, velocity;
};

struct NodeMemory {
  struct Copy {
    std::array<NodeId, 8> nodes;
    std::array<Vec3, 8> positions, velocities;
  };
  struct Piece {
    CellId cell;
    CollisionTriangle triangle;
    std::int32_t side = 0;  ///< of a tip's continuation; 0: whole
    double volume = 0;
    std::int32_t copy = 0;  ///< in copies
  };
  /// What a remembered node lends to a node of now.
  struct Share {
    NodeId node, from;
    double volume = 0;
    Vec3 position, velocity;
  };
  std::vector<Copy> copies;
  std::vector<Piece> pieces;  ///< by cell, triangle and side
  std::vector<CellId> cells;  ///< ascending
  std::vector<Share> shares;  ///< memory of recall_cells
  void clear();
  [[nodiscard]] bool empty() const { return pieces.empty(); }
};

/// Remembers the motion of all pieces of material in these cells (any order, repeats allowed), instead of what was remembered.
void remember_cells(const HexMesh& hex, const MechanicsState& state, std::span<const CellId> cells, NodeMemory& memory);

/// Gives the nodes of those cells the motion that most of their material had, to the bit. Nodes of material that is not
/// remembered stay as they are. Appends the motion that nodes had before to `old`.
void recall_cells(const HexMesh& hex, NodeMemory& memory, MechanicsState& state, std::vector<NodeMotion>& old);

/// Gives a node another motion and appends the old one to `old`, if they differ.
void move_node(NodeId node, Vec3 position, Vec3 velocity, MechanicsState& state, std::vector<NodeMotion>& old);

/// Of shares of one node, sorted by `from`: the first of that node with the most volume.
const NodeMemory::Share& largest_share(std::span<const NodeMemory::Share> shares);

}  // namespace kerf
