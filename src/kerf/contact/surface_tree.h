// A tree of boxes over the mid-surface of a body, refitted every step.
//
// Its shape is that of the uncut body: a leaf holds a few root triangles, a root triangle the list of the triangles that
// cuts have made of it. A cut changes lists only; undoing it gives the same lists again.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "kerf/base/ids.h"
#include "kerf/base/indexed.h"
#include "kerf/base/vec.h"

namespace kerf {

struct SurfaceTreeNode {
  std::uint32_t first = 0;  ///< leaf: position in roots; inner: its children are nodes first and first + 1
  std::uint32_t count = 0;  ///< root triangles of a leaf, 0 for an inner node
};

struct SurfaceTree {
  std::vector<SurfaceTreeNode> nodes;                       ///< children come after their parents
  std::vector<RootId> roots;                                ///< grouped by leaf
  IndexedArray<RootId, CollisionTriangle> first;            ///< the newest triangle of each root
  IndexedArray<CollisionTriangle, CollisionTriangle> next;  ///< the next older one of the same root

  [[nodiscard]] bool empty() const { return nodes.empty(); }
  /// Calls visit(CollisionTriangle) for every triangle of a leaf.
  template <class Visit>
  void for_each_triangle(std::uint32_t leaf, Visit&& visit) const {
    const SurfaceTreeNode node = nodes[leaf];
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i)
      for (CollisionTriangle f = first[roots[i]]; f.valid(); f = next[f]) visit(f);
  }
};

/// Builds the shape over boxes of the root triangles (empty boxes for roots without triangles). Lists stay empty.
SurfaceTree make_surface_tree(std::span<const Box3> root_boxes);

/// Four floats, so that one instruction takes a whole point; the fourth is unused.
struct alignas(16) TreeCorner {
  std::array<float, 4> x{};
};
struct TreeBox {
  TreeCorner min, max;
};
/// Its longest side.
[[nodiscard]] inline float widest(const TreeBox& b) {
  return std::max({b.max.x[0] - b.min.x[0], b.max.x[1] - b.min.x[1], b.max.x[2] - b.min.x[2]});
}
/// Boxes of a tree for one set of positions. They are rounded: with `slack` metres around it a box holds its triangles.
struct TreeBoxes {
  std::vector<TreeBox> box;        ///< per node
  std::vector<TreeCorner> points;  ///< the positions in float
  double slack = 0;
};

/// Fits the boxes; corners: 3 |F| vertices. An empty root's box is empty (min > max). O(n).
void refit(const SurfaceTree& tree, std::span<const CollisionVertex> corners, std::span<const Vec3> positions,
           TreeBoxes& boxes);
/// Boxes of unit directions below each node: of the triangles' normals and of the vertices' offsets; narrow where the surface
/// is flat. The fourth numbers are the least and the greatest length of an offset. What has no direction makes its boxes hold
/// zero. `unit` is memory. O(n).
void refit_directions(const SurfaceTree& tree, std::span<const CollisionVertex> corners, std::span<const Vec3> offsets,
                      const TreeBoxes& boxes, std::vector<TreeCorner>& unit, std::vector<TreeBox>& directions);
/// Do all directions in a box lie within 45 degrees of one axis?
bool is_narrow(const TreeBox& directions);

/// Four floats at once, whatever the machine has.
using TreeLanes = float __attribute__((vector_size(16)));
inline TreeLanes lanes(const TreeCorner& c) {
  TreeLanes v;
  std::memcpy(&v, c.x.data(), sizeof v);
  return v;
}
inline TreeLanes greater_of(TreeLanes a, TreeLanes b) { return a > b ? a : b; }
inline float sum_of_three(TreeLanes v) { return v[0] + v[1] + v[2]; }

/// Are two boxes at most `reach` (at least 0) apart along every axis?
inline bool near(const TreeBox& a, const TreeBox& b, float reach) {
  const TreeLanes gap = greater_of(lanes(a.min) - lanes(b.max), lanes(b.min) - lanes(a.max));
  const auto apart = gap > TreeLanes{reach, reach, reach, HUGE_VALF};
  return (apart[0] | apart[1] | apart[2]) == 0;
}
/// The box of both.
inline TreeBox joined(const TreeBox& a, const TreeBox& b) {
  const TreeLanes a_min = lanes(a.min), b_min = lanes(b.min), a_max = lanes(a.max), b_max = lanes(b.max);
  const TreeLanes min = b_min < a_min ? b_min : a_min, max = b_max > a_max ? b_max : a_max;
  TreeBox r;
  std::memcpy(r.min.x.data(), &min, sizeof min);
  std::memcpy(r.max.x.data(), &max, sizeof max);
  return r;
}
/// Square of the distance from a point to a box.
inline float squared_distance(const TreeBox& a, const TreeCorner& p) {
  const TreeLanes x = lanes(p), d = greater_of(greater_of(lanes(a.min) - x, x - lanes(a.max)), TreeLanes{});
  return sum_of_three(d * d);
}
inline TreeCorner to_corner(Vec3 p) {
  return {{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z), 0}};
}
/// The box of some points, at least one.
inline TreeBox box_of(std::span<const Vec3> points) {
  const TreeCorner first = to_corner(points[0]);
  TreeBox box{first, first};
  for (const Vec3 p : points.subspan(1)) box = joined(box, {to_corner(p), to_corner(p)});
  return box;
}

}  // namespace kerf
