// Which faces, and rims, the vertices of a body have to be tested with.
#include "kerf/contact/leaf_groups.h"

namespace kerf {
namespace {

using V = CollisionVertex;
using H = CollisionHalfEdge;
using F = CollisionTriangle;

void list_faces(const BodyView& body, std::uint32_t leaf, LeafBoxes& list) {
  const auto& points = body.frame.boxes.points;
  list.list(leaf, [&](auto&& add) {
    body.surface.tree.for_each_triangle(leaf, [&](F f) {
      const auto c = body.surface.vertices(f);
      const TreeCorner &x = points[c[0].index()], &y = points[c[1].index()], &z = points[c[2].index()];
      add(f.value, joined(joined({x, x}, {y, y}), {z, z}));
    });
  });
}

/// Fills scratch.near_faces with the faces that a vertex may touch, or whose rims it may face.
void find_near_faces(const BodyPair& pair, V v, const LeafGroup& group, std::span<const LeafPair> some, bool has_rim) {
  const BodyView& other = pair.b;
  const double slack = other.frame.boxes.slack + pair.a.frame.boxes.slack, r = pair.reach(v) + slack;
  const auto square = static_cast<float>(r * r), limit = static_cast<float>(pair.approach(v) + slack);
  const TreeCorner p = pair.a.frame.boxes.points[v.index()], direction = pair.a.frame.unit[v.index()];
  const TreeBox here{p, p}, mine{direction, direction};
  LeafBoxes& faces = pair.run.scratch.leaf_faces;
  auto& near = pair.run.scratch.near_faces;
  near.clear();
  const auto select_leaves = [&](const LeafBlock& leaves) {
    return leaves_near_point(leaves, p, direction, square, limit);
  };
  for_each_near_leaf(pair, group, some, select_leaves, [&](const LeafPair& leaves, bool test) {
    const std::uint32_t partner = leaves[1];
    const bool rims = has_rim && (pair.quiet == nullptr || pair.quiet->has_rim[partner] != 0);
    if (!test && !rims) return;
    const bool neighbours = pair.self && hang_together(pair.a.surface, leaves[0], partner);
    const auto select = [&](std::uint32_t block) {
      const unsigned bits = near_point(faces.block[block], p, square);
      return bits == 0
                 ? 0
                 : bits & not_side_by_side(here, mine, faces.block[block], other.frame.directions[partner], limit);
    };
    list_faces(other, partner, faces);
    faces.for_each(partner, select, [&](std::uint32_t i) {
      const F f(faces.item[i]);
      const auto c = other.surface.vertices(f);
      const bool own = pair.self && (c[0] == v || c[1] == v || c[2] == v);
      if ((rims || !own) && (!neighbours || !is_clear_neighbour(pair.a.surface, v, f)))
        near.push_back({f, rims, test && !own, neighbours});
    });
  });
}

/// A vertex against the rims of all leaves that its own leaf has to do with, and against the faces of some of them.
void search_vertex(const BodyPair& pair, V v, const LeafGroup& group, std::span<const LeafPair> some) {
  const bool on_cut = pair.self && pair.a.surface.on_cut[v] != 0;
  if (some.empty() && !on_cut) return;
  find_near_faces(pair, v, group, some, on_cut && rim_at(pair.a, v).count > 0);
  const bool touches = !pair.run.scratch.near_faces.empty() && test_vertex(pair, v);
  if (pair.quiet != nullptr) pair.quiet->vertex[v.index()].touched = touches ? 1 : 0;
}

std::span<const LeafPair> vertex_pairs(const BodyPair& pair, V v, const LeafGroup& group) {
  // Which side a vertex is on of what it touches says so of the faces around it as well: those have to be looked at.
  if (pair.quiet == nullptr || pair.quiet->vertex[v.index()].touched != 0) return group.pairs;
  return pairs_to_test(pair, group, pair.approach(v), pair.quiet->vertex[v.index()],
                       [&](const LeafPair& leaves, double limit, double most) {
                         return quiet_vertex(pair.a, v, leaves, limit, most, pair.run.scratch.neighbours);
                       });
}

}  // namespace

void search_vertices(const BodyPair& pair) {
  const ContactSurface& surface = pair.a.surface;
  pair.run.scratch.leaf_faces.clear(pair.b.surface.tree.nodes.size());
  for_each_group(pair, [&](const LeafGroup& group) {
    surface.tree.for_each_triangle(group.pairs[0][0], [&](F f) {
      for (int k = 0; k < 3; ++k)
        if (const H h = ContactSurface::corner(f, k); surface.owns_vertex(h)) {
          const V v = surface.origin[h];
          search_vertex(pair, v, group, vertex_pairs(pair, v, group));
        }
    });
  });
}

}  // namespace kerf
