// Two lattices of the same mesh compared without regard to ids.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <vector>

#include "kerf/lattice/hex_mesh.h"

namespace kerf {

struct CanonicalCopy {
  std::int32_t cell = 0;
  std::vector<std::array<std::int32_t, 2>> pieces;  ///< (triangle, side)
  HexId id;
  friend bool operator<(const CanonicalCopy& a, const CanonicalCopy& b) {
    return a.cell != b.cell ? a.cell < b.cell : a.pieces < b.pieces;
  }
};

inline std::vector<CanonicalCopy> canonical_copies(const HexMesh& hex) {
  std::vector<CanonicalCopy> copies(hex.hex_count());
  for (const CollisionTriangle t : ids<CollisionTriangle>(hex.pieces.size()))
    for (const Piece& p : hex.pieces_of(t)) copies[p.copy.index()].pieces.push_back({t.value, p.side});
  std::vector<CanonicalCopy> out;
  for (const HexId h : ids<HexId>(hex.hex_count())) {
    if (hex.state[h] == HexState::kDead) continue;
    copies[h.index()].cell = hex.cell_id(hex.cell[h]).value;
    copies[h.index()].id = h;
    std::sort(copies[h.index()].pieces.begin(), copies[h.index()].pieces.end());
    out.push_back(copies[h.index()]);
  }
  std::sort(out.begin(), out.end());
  return out;
}

/// Same copies, same node classes, same states, hosts and fills.
inline ::testing::AssertionResult same_lattice(const HexMesh& a, const HexMesh& b) {
  const auto ca = canonical_copies(a), cb = canonical_copies(b);
  if (ca.size() != cb.size()) return ::testing::AssertionFailure() << ca.size() << " copies against " << cb.size();
  std::vector<std::size_t> rank_a(a.hex_count()), rank_b(b.hex_count());
  for (std::size_t i = 0; i < ca.size(); ++i) {
    if (ca[i] < cb[i] || cb[i] < ca[i])
      return ::testing::AssertionFailure() << "other pieces in cell " << ca[i].cell << " / " << cb[i].cell;
    rank_a[ca[i].id.index()] = rank_b[cb[i].id.index()] = i;
  }
  std::map<NodeId, std::size_t> class_a, class_b;
  for (std::size_t i = 0; i < ca.size(); ++i) {
    const HexId x = ca[i].id, y = cb[i].id;
    if (a.state[x] != b.state[y]) return ::testing::AssertionFailure() << "state differs in cell " << ca[i].cell;
    if (rank_a[a.host[x].index()] != rank_b[b.host[y].index()])
      return ::testing::AssertionFailure() << "host differs in cell " << ca[i].cell;
    const HexMaterial &m = a.material[x], &n = b.material[y];
    if (m.fill != n.fill || m.full != n.full)
      return ::testing::AssertionFailure() << "fill " << m.fill << " against " << n.fill;
    if (std::fabs(m.volume - n.volume) > 1e-12 * a.frame_of(x).cell_volume() ||
        std::fabs(m.mass_volume - n.mass_volume) > 1e-12 * a.frame_of(x).cell_volume())
      return ::testing::AssertionFailure() << "volume " << m.volume << " against " << n.volume << ", mass "
                                           << m.mass_volume << " against " << n.mass_volume;
    for (std::size_t q = 0; q < 27; ++q)
      if (std::fabs(a.weights[x][q] - b.weights[y][q]) > 1e-12)
        return ::testing::AssertionFailure() << "weights differ in cell " << ca[i].cell;
    for (std::size_t k = 0; k < 8; ++k) {
      const auto ia = class_a.emplace(a.nodes[x][k], 8 * i + k).first,
                 ib = class_b.emplace(b.nodes[y][k], 8 * i + k).first;
      if (ia->second != ib->second)
        return ::testing::AssertionFailure() << "nodes shared differently in cell " << ca[i].cell << " corner " << k;
      if (a.node_uses[a.nodes[x][k]] != b.node_uses[b.nodes[y][k]])
        return ::testing::AssertionFailure() << "node uses differ";
    }
  }
  return ::testing::AssertionSuccess();
}

}  // namespace kerf
