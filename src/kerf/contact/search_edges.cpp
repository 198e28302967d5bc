// Which coarse edges of bodies have to be tested with each other.
#include "kerf/contact/leaf_groups.h"

namespace kerf {
namespace {

using V = CollisionVertex;
using H = CollisionHalfEdge;
using F = CollisionTriangle;

/// So few leaves are not worth looking at eight at a time.
constexpr std::size_t kFewLeaves = 3;

void list_edges(const BodyView& body, std::uint32_t leaf, LeafEdges& list) {
  const auto& points = body.frame.boxes.points;
  list.list(leaf, [&](auto&& add) {
    body.surface.tree.for_each_triangle(leaf, [&](F f) {
      for (int i = 0; i < 3; ++i) {
        const H h = ContactSurface::corner(f, i);
        if (!body.surface.owns_edge(h) || !body.surface.is_coarse_edge(h)) continue;
        const TreeCorner &a = points[body.surface.from(h).index()], &b = points[body.surface.to(h).index()];
        add(h.value, joined({a, a}, {b, b}));
        list.set_last(a, b, body.surface.from(h).value, body.surface.to(h).value, body.surface.cut[h] != 0, leaf);
      }
    });
  });
}

/// Calls visit(edge of the other leaf, which comes near) for all of them that edge `i` has to do with and that select(list, number of a block, bits)
/// leaves of those that are near.
template <class Select, class Visit>
void for_each_edge(const BodyPair& pair, std::uint32_t i, const LeafPair& leaves, float reach, Select&& select,
                   Visit&& visit) {
  const auto [leaf, other] = leaves;
  LeafEdges &mine = pair.run.scratch.leaf_edges, &others = pair.self ? mine : pair.run.scratch.other_leaf_edges;
  const TreeBox box = mine.box[i];
  list_edges(pair.b, other, others);
  const std::uint32_t first = leaf == other && pair.self ? i + 1 : 0;  // of one leaf with itself, each pair once
  const auto chosen = [&](std::uint32_t block) {
    const unsigned bits = near_box(others.block[block], box, reach);
    return bits == 0 ? 0 : select(others, block, bits);
  };
  others.for_each(other, chosen, [&](std::uint32_t k) {
    if (k >= first) visit(H(others.item[k]));
  });
}

/// Towards leaves that come later in their order.
std::span<const LeafPair> edge_pairs(const BodyPair& pair, std::uint32_t i, const LeafGroup& group, double approach) {
  if (pair.quiet == nullptr) return group.pairs;
  const H h(pair.run.scratch.leaf_edges.item[i]);
  const double reach = 2 * pair.a.frame.greatest_offset + quiet_skin(pair.a) + 2 * pair.a.frame.boxes.slack;
  return pairs_to_test(
      pair, group, approach, pair.quiet->edge[h.index()], [&](const LeafPair& leaves, double limit, double most) {
        const auto far = static_cast<float>(reach + limit);
        if (leaves[1] < leaves[0] || !near(pair.run.scratch.leaf_edges.box[i], pair.b.frame.boxes.box[leaves[1]], far))
          return most;
        const bool together = hang_together(pair.a.surface, leaves[0], leaves[1]);
        const auto all = [](const LeafEdges&, std::uint32_t, unsigned near) { return near; };
        for_each_edge(pair, i, leaves, far, all, [&](H g) {
          if (most > 0) most = quiet_edges(pair.a, h, g, together, limit, most, pair.run.scratch.neighbours);
        });
        return most;
      });
}

/// A coarse edge against those of other leaves.
void search_edge(const BodyPair& pair, std::uint32_t i, const LeafGroup& group, std::span<const LeafPair> some,
                 double reach, double approach) {
  const double slack = pair.a.frame.boxes.slack + pair.b.frame.boxes.slack;
  const auto r = static_cast<float>(reach + slack), limit = static_cast<float>(approach + slack);
  const H h(pair.run.scratch.leaf_edges.item[i]);
  const TreeBox box = pair.run.scratch.leaf_edges.box[i];
  const V from = pair.a.surface.from(h), to = pair.a.surface.to(h);
  const auto& points = pair.a.frame.boxes.points;
  SegmentProbe probe{points[from.index()], points[to.index()], -1, -1, static_cast<float>(slack)};
  if (pair.self) probe.from = from.value, probe.to = to.value;
  const bool rim = pair.self && pair.a.surface.cut[h] != 0;
  const TreeBox& directions = pair.a.frame.directions[group.pairs[0][0]];
  const auto search_leaf = [&](const LeafPair& leaves, bool test) {
    if (!test || (pair.self && leaves[1] < leaves[0])) return;
    const TreeBox& other_directions = pair.b.frame.directions[leaves[1]];
    const bool neighbours = pair.self && hang_together(pair.a.surface, leaves[0], leaves[1]);
    const auto select = [&](const LeafEdges& others, std::uint32_t block, unsigned near) {
      const SegmentBlock& ends = others.ends[block];
      const unsigned bits = near & (may_have_inner_feet(ends, probe) | (rim ? ends.rims : 0));
      return bits == 0 ? 0 : bits & not_side_by_side(box, directions, others.block[block], other_directions, limit);
    };
    for_each_edge(pair, i, leaves, r, select, [&](H g) {
      if (!neighbours || !are_clear_neighbours(pair.a.surface, h, g)) test_edges(pair, h, g, reach);
    });
  };
  if (some.size() > kFewLeaves) {
    for_each_near_leaf(
        pair, group, some, [&](const LeafBlock& leaves) { return leaves_near_box(leaves, box, directions, r, limit); },
        search_leaf);
  } else {
    for (const LeafPair& leaves : some)
      if (near(box, pair.b.frame.boxes.box[leaves[1]], r)) search_leaf(leaves, true);
  }
}

}  // namespace

void search_edges(const BodyPair& pair, double reach, double approach) {
  LeafEdges &mine = pair.run.scratch.leaf_edges, &others = pair.self ? mine : pair.run.scratch.other_leaf_edges;
  mine.clear(pair.a.surface.tree.nodes.size());
  others.clear(pair.b.surface.tree.nodes.size());
  for_each_group(pair, [&](const LeafGroup& group) {
    const std::uint32_t leaf = group.pairs[0][0];
    list_edges(pair.a, leaf, mine);
    if (pair.quiet != nullptr)
      for (std::uint32_t i = mine.leaf[leaf].begin; i < mine.leaf[leaf].end; ++i)
        __builtin_prefetch(&pair.quiet->edge[H(mine.item[i]).index()]);
    for (std::uint32_t i = mine.leaf[leaf].begin; i < mine.leaf[leaf].end; ++i) {
      const H h(mine.item[i]);
      const std::span<const LeafPair> some = edge_pairs(pair, i, group, approach);
      if (some.empty()) continue;
      const std::size_t before = pair.run.scratch.found.size();
      search_edge(pair, i, group, some, reach, approach);
      if (pair.quiet != nullptr) pair.quiet->edge[h.index()].touched = pair.run.scratch.found.size() > before ? 1 : 0;
    }
  });
}

}  // namespace kerf
