#include "kerf/lattice/lattice_validate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "kerf/base/long_sum.h"
#include "kerf/lattice/lattice_tolerances.h"
#include "kerf/lattice/tip_glue.h"

namespace kerf {
namespace {

class UnionFind {
 public:
  explicit UnionFind(std::size_t n) : parent_(n) {
    for (std::size_t i = 0; i < n; ++i) parent_[i] = i;
  }
  std::size_t find(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::size_t a, std::size_t b) { parent_[find(a)] = find(b); }

 private:
  std::vector<std::size_t> parent_;
};

template <class Counts>
std::size_t count_classes(UnionFind& sets, std::size_t n, Counts&& counts) {
  std::size_t classes = 0;
  for (std::size_t i = 0; i < n; ++i)
    if (counts(i) && sets.find(i) == i) ++classes;
  return classes;
}

/// Nodes that two copies have in common.
int common_nodes(const HexMesh& hex, HexId a, HexId b) {
  int n = 0;
  for (const NodeId x : hex.nodes[a])
    for (const NodeId y : hex.nodes[b]) n += x == y ? 1 : 0;
  return n;
}

}  // namespace

HexPieces count_hex_pieces(const HexMesh& hex) {
  HexPieces pieces;
  const std::size_t n = hex.hex_count();
  UnionFind nodes(hex.node_count()), faces(n);
  std::vector<std::uint8_t> used(hex.node_count(), 0);
  for (const HexId h : ids<HexId>(n)) {
    if (!hex.alive(h)) continue;
    for (const NodeId x : hex.nodes[h]) {
      nodes.join(x.index(), hex.nodes[h][0].index());
      used[x.index()] = 1;
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      LatticeIndex next = hex.cell[h];
      ++next[axis];
      if (!hex.contains(next)) continue;
      for (HexId o = hex.first_copy[hex.cell_id(next)]; o.valid(); o = hex.next_in_cell[o])
        if (hex.alive(o) && common_nodes(hex, h, o) == 4) faces.join(h.index(), o.index());
    }
    // Copies of one cell with the same eight nodes (a slit inside one cell): nothing between them.
    for (HexId o = hex.next_in_cell[h]; o.valid(); o = hex.next_in_cell[o])
      if (hex.alive(o) && hex.nodes[o] == hex.nodes[h]) faces.join(h.index(), o.index());
  }
  for (const TipId t : ids<TipId>(hex.tips.size())) {  // a split ahead of a tip is no cut
    const TipCopies copies = tip_copies(hex, t);
    if (!copies.left.valid() || !copies.right.valid()) continue;
    const HexId a = hex.host[copies.left], b = hex.host[copies.right];
    faces.join(a.index(), b.index());
    nodes.join(hex.nodes[a][0].index(), hex.nodes[b][0].index());
  }
  pieces.by_nodes = count_classes(nodes, hex.node_count(), [&](std::size_t i) { return used[i] != 0; });
  pieces.by_faces = count_classes(faces, n, [&](std::size_t i) { return hex.alive(HexId(i)); });
  return pieces;
}

std::size_t count_collision_pieces(const CollisionMesh& mesh) {
  UnionFind sets(mesh.face_count());
  for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(mesh.half_edge_count()))
    if (mesh.twin[h].valid()) sets.join(CollisionMesh::face(h).index(), CollisionMesh::face(mesh.twin[h]).index());
  return count_classes(sets, mesh.face_count(), [](std::size_t) { return true; });
}

std::size_t count_plain_nodes(const HexMesh& hex) {
  std::vector<std::uint8_t> used;
  for (const HexId h : ids<HexId>(hex.hex_count())) {
    if (hex.state[h] == HexState::kDead) continue;
    for (int c = 0; c < 8; ++c) {
      const auto q = static_cast<std::size_t>(hex.corner_number(LatticeFrame::corner(hex.cell[h], c)));
      if (q >= used.size()) used.resize(q + 1, 0);
      used[q] = 1;
    }
  }
  return static_cast<std::size_t>(std::count(used.begin(), used.end(), 1));
}

namespace {

/// Lists of tips: each in that of its vertex, the active ones in that of their cell.
Status check_tips(const CollisionMesh& mesh, const HexMesh& hex) {
  std::vector<std::uint8_t> of_vertex(hex.tips.size(), 0), in_cell(hex.tips.size(), 0);
  const auto wrong = [](TipId t, const char* what) { return failed(fmt::format("tip {}: {}", t.value, what)); };
  for (const CollisionVertex v : ids<CollisionVertex>(mesh.vertex_count()))
    for (TipId t = hex.vertex_tip[v]; t.valid(); t = hex.tips[t].next_of_vertex)
      if (hex.tips[t].vertex != v || of_vertex[t.index()]++ > 0) return wrong(t, "is listed at another vertex");
  for (const CellId c : ids<CellId>(hex.cell_count()))
    for (TipId t = hex.first_tip[c]; t.valid(); t = hex.tips[t].next_in_cell)
      if (!hex.tips[t].active || hex.tips[t].cell != c || in_cell[t.index()]++ > 0)
        return wrong(t, "is listed in another cell");
  for (const TipId t : ids<TipId>(hex.tips.size())) {
    const TipCell& tip = hex.tips[t];
    if (!tip.active) continue;
    if (of_vertex[t.index()] != 1 || in_cell[t.index()] != 1) return wrong(t, "is in no list");
    if (!is_finite(tip.point) || !is_finite(tip.direction) || !is_finite(tip.normal)) return wrong(t, "is not finite");
  }
  return {};
}

/// Lists of copies that were given to others, and links.
Status check_copies(const HexMesh& hex) {
  std::vector<std::uint8_t> listed(hex.hex_count(), 0);
  for (const HexId h : ids<HexId>(hex.hex_count()))
    for (HexId g = hex.first_guest[h]; g.valid(); g = hex.next_guest[g])
      if (hex.absorber[g] != h || listed[g.index()]++ > 0)
        return failed(fmt::format("copy {} is listed as a guest of {}", g.value, h.value));
  for (const LatticeRun& run : hex.links.raw())
    for (std::int32_t i = 0; i < run.count; ++i)
      for (const HexId h : hex.link_pool[LatticePoolIndex(run.first + i)])
        if (!hex.cell.contains(h)) return failed("a link between copies ends nowhere");
  for (const PrismCorners& corners : hex.prism_corner.raw())
    if (!is_finite(corners.minus) || !is_finite(corners.plus)) return failed("a corner of a prism is not finite");
  return {};
}

}  // namespace

Status validate_lattice(const CollisionMesh& mesh, const HexMesh& hex) {
  KERF_TRY(check_tips(mesh, hex));
  KERF_TRY(check_copies(hex));
  std::vector<std::int32_t> uses(hex.node_count(), 0), pieces(hex.hex_count(), 0), in_cell(hex.hex_count(), 0);
  for (const CellId c : ids<CellId>(hex.cell_count()))
    for (HexId h = hex.first_copy[c]; h.valid(); h = hex.next_in_cell[h]) {
      if (++in_cell[h.index()] > 1) return failed(fmt::format("copy {} is listed twice", h.value));
      if (hex.state[h] == HexState::kDead)
        return failed(fmt::format("dead copy {} is still listed in its cell", h.value));
      if (hex.cell_id(hex.cell[h]) != c) return failed(fmt::format("copy {} is listed in another cell", h.value));
    }
  LongSum volumes, masses;
  for (const HexId h : ids<HexId>(hex.hex_count())) {
    if (hex.state[h] == HexState::kDead) {
      if (in_cell[h.index()] != 0 || hex.host[h].valid())
        return failed(fmt::format("copy {} is dead but in use", h.value));
      continue;
    }
    if (in_cell[h.index()] != 1)
      return failed(fmt::format("copy {} is {} times in its cell", h.value, in_cell[h.index()]));
    const auto& nodes = hex.nodes[h];
    for (int c = 0; c < 8; ++c) {
      const NodeId n = nodes[static_cast<std::size_t>(c)];
      if (!hex.corner.contains(n)) return failed(fmt::format("copy {} has no node at corner {}", h.value, c));
      if (hex.corner[n] != LatticeFrame::corner(hex.cell[h], c))
        return failed(fmt::format("copy {}: node {} lies at another corner of the lattice", h.value, n.value));
      for (int d = 0; d < c; ++d)
        if (nodes[static_cast<std::size_t>(d)] == n)
          return failed(fmt::format("copy {} has node {} twice", h.value, n.value));
      if (hex.alive(h)) ++uses[n.index()];
    }
    const HexId host = hex.host[h];
    if (!host.valid() || !hex.alive(host)) return failed(fmt::format("copy {} has no living host", h.value));
    if (hex.alive(h) != (host == h) || hex.alive(h) == hex.absorber[h].valid())
      return failed(fmt::format("copy {}: state, host and absorber disagree", h.value));
    HexId end = h;
    for (std::size_t i = 0; i < hex.hex_count() && hex.absorber[end].valid(); ++i) end = hex.absorber[end];
    if (end != host)
      return failed(fmt::format("copy {}: host {} is not the end of its absorbers", h.value, host.value));
    const HexMaterial& m = hex.material[h];
    double weight = 0;
    for (const double w : hex.weights[h]) weight += w;
    const double cell_volume = hex.frame_of(h).cell_volume();
    if (!(std::fabs(weight * cell_volume - m.volume) <= 1e-9 * cell_volume))
      return failed(fmt::format("copy {}: quadrature weights add up to {} m3, not to {}", h.value, weight * cell_volume,
                                m.volume));
    volumes.add(m.volume);
    if (hex.alive(h)) masses.add(m.mass_volume);
    else if (m.mass_volume != 0) return failed(fmt::format("absorbed copy {} still has mass", h.value));
  }
  for (const NodeId n : ids<NodeId>(hex.node_count()))
    if (uses[n.index()] != hex.node_uses[n])
      return failed(fmt::format("node {} counts {} copies, but {} use it", n.value, hex.node_uses[n], uses[n.index()]));

  LongSum prisms;
  std::size_t most_pieces = 0;
  for (const CollisionTriangle t : ids<CollisionTriangle>(mesh.face_count())) {
    const LatticeBody& own = hex.bodies[static_cast<std::size_t>(hex.body_of(mesh.root[t]))];
    prisms.add(own.scale * own.frame.cell_volume() *
               ruled_volume(prism_between(hex.prism_corner[mesh.origin[CollisionMesh::corner(t, 0)]],
                                          hex.prism_corner[mesh.origin[CollisionMesh::corner(t, 1)]],
                                          hex.prism_corner[mesh.origin[CollisionMesh::corner(t, 2)]])));
    most_pieces = std::max(most_pieces, hex.pieces_of(t).size());
    if (hex.pieces_of(t).empty()) return failed(fmt::format("collision triangle {} is in no copy", t.value));
    for (const Piece& p : hex.pieces_of(t)) {
      if (!hex.cell.contains(p.copy) || hex.state[p.copy] == HexState::kDead || hex.cell_id(hex.cell[p.copy]) != p.cell)
        return failed(fmt::format("collision triangle {}: a piece names copy {}", t.value, p.copy.value));
      ++pieces[p.copy.index()];
      if (hex.material[p.copy].body != hex.body_of(mesh.root[t]))
        return failed(fmt::format("collision triangle {}: copy {} belongs to another body", t.value, p.copy.value));
      const auto members = hex.members_of(p.cell);
      if (!std::binary_search(members.begin(), members.end(), t))
        return failed(fmt::format("collision triangle {} is missing in a cell's list", t.value));
    }
  }
  for (const HexId h : ids<HexId>(hex.hex_count()))
    if (hex.state[h] != HexState::kDead && pieces[h.index()] != hex.piece_count[h])
      return failed(fmt::format("copy {} has {} pieces, not {}", h.value, pieces[h.index()], hex.piece_count[h]));
  const double volume = volumes.value(), mass = masses.value(), body = prisms.value();
  // Pieces of a triangle are scaled by their plain sum, which loses up to half an epsilon a piece.
  const double tolerance =
      (kVolumeRounding + std::numeric_limits<double>::epsilon() * static_cast<double>(most_pieces)) * body;
  if (!(std::fabs(volume - body) <= tolerance) || !(std::fabs(mass - body) <= tolerance))
    return failed(fmt::format("the copies hold {:.17g} m3 (with hosts {:.17g}), the body {:.17g}", volume, mass, body));

  // Both sides of an uncut edge, wherever its wall passes.
  for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(mesh.half_edge_count())) {
    const CollisionHalfEdge g = mesh.twin[h];
    if (!g.valid() || g < h) continue;
    const PrismWall wall = wall_between(hex.prism_corner[mesh.from(h)], hex.prism_corner[mesh.to(h)]);
    const CollisionTriangle t = CollisionMesh::face(h), u = CollisionMesh::face(g);
    for (const Piece& p : hex.pieces_of(t))
      for (const Piece& q : hex.pieces_of(u)) {
        if (p.cell != q.cell || p.side != 0 || q.side != 0 || p.copy == q.copy) continue;
        if (!wall_meets_cell(wall, hex.index_of(p.cell))) continue;
        bool tip_between = false;
        for (TipId tip = hex.first_tip[p.cell]; tip.valid(); tip = hex.tips[tip].next_in_cell)
          for (const CollisionHalfEdge e : hex.tips[tip].along) tip_between = tip_between || e == h || e == g;
        if (!tip_between)
          return failed(fmt::format("collision triangles {} and {} share an uncut edge but lie in copies {} and {}",
                                    t.value, u.value, p.copy.value, q.copy.value));
      }
  }
  return {};
}

Status validate_lattice_pieces(const CollisionMesh& mesh, const HexMesh& hex) {
  const std::size_t collision = count_collision_pieces(mesh);
  const HexPieces pieces = count_hex_pieces(hex);
  if (pieces.by_nodes != collision || pieces.by_faces != collision)
    return failed(fmt::format("the collision mesh has {} pieces, the hexahedra {} through nodes and {} through faces",
                              collision, pieces.by_nodes, pieces.by_faces));
  return {};
}

}  // namespace kerf
