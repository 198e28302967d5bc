#include "kerf/lattice/lattice_remove.h"

#include <vector>

#include "kerf/base/indexed.h"

namespace kerf {
namespace {

/// Arrays of a HexMesh that are renamed below; a new one needs a line there.
constexpr std::size_t kArrays = 29;

/// A pool whose runs are packed one after another, each with room for what it holds only. change(item, kept) says what stays.
template <class Index, class Item, class Runs, class Change>
void pack(Journaled<Index, Item>& pool, Runs& runs, Change&& change) {
  std::vector<Item> items;
  std::vector<LatticeRun> packed;
  packed.reserve(runs.size());
  for (const LatticeRun& run : runs.raw()) {
    LatticeRun out{static_cast<std::int32_t>(items.size()), 0, 0};
    for (std::int32_t i = 0; i < run.count; ++i) {
      Item item = pool[Index(run.first + i)];
      if (!change(item)) continue;
      items.push_back(item);
      ++out.count;
    }
    out.capacity = out.count;
    packed.push_back(out);
  }
  pool = Journaled<Index, Item>(std::move(items));
  runs = Runs(std::move(packed));
}

/// The first item of a list, from `first` on, that stays.
template <class Id, class Next>
Id first_kept(const IdMap<Id>& map, Id first, const Next& next) {
  while (first.valid() && !map.keeps(first)) first = next(first);
  return map(first);
}

}  // namespace

LatticeRenaming remove_from_lattice(HexMesh& hex, const IdMap<CollisionVertex>& vertex,
                                    const IdMap<CollisionHalfEdge>& half_edge, const IdMap<CollisionTriangle>& triangle,
                                    const CollisionMesh& mesh) {
  std::size_t arrays = 0;
  hex.for_each_array([&](const auto&) { ++arrays; });
  KERF_ASSERT(arrays == kArrays);
  (void)arrays;
  LatticeRenaming r;
  std::vector<std::uint8_t> keep_copy(hex.hex_count(), 0), keep_node(hex.node_count(), 0);
  for (const HexId h : ids<HexId>(hex.hex_count())) keep_copy[h.index()] = hex.state[h] != HexState::kDead ? 1 : 0;
  for (const CollisionTriangle t : ids<CollisionTriangle>(triangle.old_count()))
    if (!triangle.keeps(t))
      for (const Piece& p : hex.pieces_of(t)) keep_copy[p.copy.index()] = 0;
  for (const HexId h : ids<HexId>(hex.hex_count()))
    if (keep_copy[h.index()])
      for (const NodeId n : hex.nodes[h]) keep_node[n.index()] = 1;
  r.copy = IdMap<HexId>(keep_copy);
  r.node = IdMap<NodeId>(keep_node);
  const IdMap<TipId> tip = id_map<TipId>(hex.tips.size(), [&](TipId t) { return vertex.keeps(hex.tips[t].vertex); });

  // Lists: links over what goes.
  const auto next_copy = [&](HexId h) { return hex.next_in_cell[h]; };
  const auto next_guest = [&](HexId h) { return hex.next_guest[h]; };
  const auto next_of_vertex = [&](TipId t) { return hex.tips[t].next_of_vertex; };
  const auto next_in_cell = [&](TipId t) { return hex.tips[t].next_in_cell; };
  const auto all_cells = id_map<CellId>(hex.first_copy.size(), [](CellId) { return true; });
  keep_items(hex.first_copy, all_cells, [&](HexId h) { return first_kept(r.copy, h, next_copy); });
  keep_items(hex.first_tip, all_cells, [&](TipId t) { return first_kept(tip, t, next_in_cell); });
  keep_items(hex.first_guest, r.copy, [&](HexId h) { return first_kept(r.copy, h, next_guest); });
  keep_items(hex.vertex_tip, vertex, [&](TipId t) { return first_kept(tip, t, next_of_vertex); });
  {
    std::vector<HexId> next_cell, next;
    for (const HexId h : ids<HexId>(hex.hex_count()))
      if (r.copy.keeps(h)) {
        next_cell.push_back(first_kept(r.copy, hex.next_in_cell[h], next_copy));
        next.push_back(first_kept(r.copy, hex.next_guest[h], next_guest));
      }
    hex.next_in_cell = Journaled<HexId, HexId>(std::move(next_cell));
    hex.next_guest = Journaled<HexId, HexId>(std::move(next));
  }
  {
    std::vector<TipCell> tips;
    for (const TipId t : ids<TipId>(hex.tips.size())) {
      if (!tip.keeps(t)) continue;
      TipCell c = hex.tips[t];
      c.vertex = vertex(c.vertex);
      c.next_of_vertex = first_kept(tip, c.next_of_vertex, next_of_vertex);
      c.next_in_cell = first_kept(tip, c.next_in_cell, next_in_cell);
      c.left = triangle(c.left);
      c.right = triangle(c.right);
      for (CollisionHalfEdge& h : c.along) h = half_edge(h);
      tips.push_back(c);
    }
    hex.tips = Journaled<TipId, TipCell>(std::move(tips));
  }

  // Pools. Pieces and their moments go together.
  {
    std::vector<Piece> pieces;
    std::vector<Moments> moments;
    std::vector<LatticeRun> runs;
    for (const CollisionTriangle t : ids<CollisionTriangle>(triangle.old_count())) {
      if (!triangle.keeps(t)) continue;
      const LatticeRun run = hex.pieces[t];
      runs.push_back({static_cast<std::int32_t>(pieces.size()), run.count, run.count});
      for (std::int32_t i = 0; i < run.count; ++i) {
        Piece p = hex.piece_pool[PieceIndex(run.first + i)];
        p.copy = r.copy(p.copy);
        p.tip = tip(p.tip);
        pieces.push_back(p);
        moments.push_back(hex.piece_moments[PieceIndex(run.first + i)]);
      }
    }
    hex.pieces = Journaled<CollisionTriangle, LatticeRun>(std::move(runs));
    hex.piece_pool = Journaled<PieceIndex, Piece>(std::move(pieces));
    hex.piece_moments = Journaled<PieceIndex, Moments>(std::move(moments));
  }
  pack(hex.member_pool, hex.members, [&](CollisionTriangle& t) {
    t = triangle(t);
    return t.valid();
  });
  pack(hex.link_pool, hex.links, [&](HexLink& link) {
    for (HexId& h : link) h = r.copy(h);
    return link[0].valid() && link[1].valid();
  });

  keep_items(hex.shape, triangle);
  keep_items(hex.prism_corner, vertex);
  for (const CollisionVertex v : ids<CollisionVertex>(hex.prism_corner.size())) {
    PrismCorners c = hex.prism_corner[v];
    c.root = first_ancestor(mesh, v);
    hex.prism_corner.set(v, c);
  }
  keep_items(hex.cell, r.copy);
  keep_items(hex.nodes, r.copy, [&](std::array<NodeId, 8> nodes) {
    for (NodeId& n : nodes) n = r.node(n);
    return nodes;
  });
  keep_items(hex.state, r.copy);
  keep_items(hex.host, r.copy, r.copy);
  keep_items(hex.parent, r.copy, r.copy);
  keep_items(hex.material, r.copy);
  keep_items(hex.weights, r.copy);
  keep_items(hex.absorber, r.copy, r.copy);
  keep_items(hex.first_piece, r.copy, [&](std::array<std::int32_t, 2> p) {
    p[0] = triangle(CollisionTriangle(p[0])).value;
    return p;
  });
  keep_items(hex.piece_count, r.copy);
  keep_items(hex.corner, r.node);
  keep_items(hex.node_parent, r.node, r.node);
  keep_items(hex.node_uses, r.node);
  return r;
}

}  // namespace kerf
