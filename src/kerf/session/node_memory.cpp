#include "kerf/session/node_memory.h"

#include <algorithm>
#include <tuple>

namespace kerf {
namespace {

auto key(const NodeMemory::Piece& p) { return std::tuple(p.cell, p.triangle); }

/// Calls f(triangle, piece) for the pieces of a cell, by triangle.
template <class Fn>
void for_each_piece(const HexMesh& hex, CellId cell, Fn&& f) {
  for (const CollisionTriangle t : hex.members_of(cell))
    for (const Piece& p : hex.pieces_of(t))
      if (p.cell == cell) f(t, p);
}

void inherit(HexId copy, std::int32_t from, double volume, std::vector<NodeMemory::Heir>& heirs) {
  for (auto heir = heirs.rbegin(); heir != heirs.rend(); ++heir)  // neighbours mostly go together
    if (heir->copy == copy && heir->from == from) {
      heir->volume += volume;
      return;
    }
  heirs.push_back({copy, from, volume});
}

}  // namespace

void NodeMemory::clear() {
  copies.clear();
  pieces.clear();
  cells.clear();
}

void remember_cells(const HexMesh& hex, const MechanicsState& state, const NodeFade& fade,
                    std::span<const CellId> cells, NodeMemory& memory) {
  memory.clear();
  memory.cells.assign(cells.begin(), cells.end());
  std::sort(memory.cells.begin(), memory.cells.end());
  memory.cells.erase(std::unique(memory.cells.begin(), memory.cells.end()), memory.cells.end());
  for (const CellId cell : memory.cells) {
    const std::size_t first = memory.copies.size();
    for (HexId h = hex.first_copy[cell]; h.valid(); h = hex.next_in_cell[h]) {
      NodeMemory::Copy copy;
      for (std::size_t c = 0; c < 8; ++c) copy.nodes[c] = motion_of(state, fade, hex.nodes[h][c]);
      memory.copies.push_back(copy);
    }
    for_each_piece(hex, cell, [&](CollisionTriangle t, const Piece& p) {
      std::size_t copy = first;
      for (HexId h = hex.first_copy[cell]; h.valid() && h != p.copy; h = hex.next_in_cell[h]) ++copy;
      memory.pieces.push_back({cell, t, p.side, p.volume, static_cast<std::int32_t>(copy)});
    });
  }
  KERF_ASSERT(std::is_sorted(memory.pieces.begin(), memory.pieces.end(),
                             [](const auto& a, const auto& b) { return key(a) < key(b); }));
}

void recall_cells(const HexMesh& hex, const MechanicsModel& model, NodeMemory& memory, MechanicsState& state,
                  NodeFade& fade, std::vector<NodeMotion>& old) {
  auto& heirs = memory.heirs;
  auto& shares = memory.shares;
  shares.clear();
  auto before = memory.pieces.begin();
  for (const CellId cell : memory.cells) {
    heirs.clear();
    for_each_piece(hex, cell, [&](CollisionTriangle t, const Piece& now) {
      // Both lists are in the same order; a triangle has few pieces in a cell.
      const std::tuple here(cell, t);
      while (before != memory.pieces.end() && key(*before) < here) ++before;
      for (auto p = before; p != memory.pieces.end() && key(*p) == here; ++p)
        if (p->side * now.side >= 0) inherit(now.copy, p->copy, std::min(p->volume, now.volume), heirs);
    });
    for (const NodeMemory::Heir& heir : heirs)
      for (std::size_t c = 0; c < 8; ++c)
        shares.push_back(
            {hex.nodes[heir.copy][c], heir.volume, memory.copies[static_cast<std::size_t>(heir.from)].nodes[c]});
  }
  // Stable: the order of a sum must not depend on the sort.
  std::stable_sort(shares.begin(), shares.end(), [](const auto& a, const auto& b) {
    return std::tuple(a.node, a.from.node) < std::tuple(b.node, b.from.node);
  });
  for (std::size_t i = 0, end; i < shares.size(); i = end) {
    for (end = i; end < shares.size() && shares[end].node == shares[i].node;) ++end;
    const std::span<const NodeMemory::Share> all(shares.data() + i, end - i);
    const NodeMemory::Share& share = largest_share(all);
    NodeMotion to = share.from;
    if (model.is_fixed(share.node)) to.velocity = model.prescribed_velocities()[share.node.index()];
    move_node(share.node, to, state, fade, old);
  }
}

const NodeMemory::Share& largest_share(std::span<const NodeMemory::Share> shares) {
  std::size_t best = 0;
  double most = -1;
  for (std::size_t i = 0, end; i < shares.size(); i = end) {
    double volume = 0;
    for (end = i; end < shares.size() && shares[end].from.node == shares[i].from.node; ++end)
      volume += shares[end].volume;
    if (volume > most) most = volume, best = i;
  }
  return shares[best];
}

}  // namespace kerf
