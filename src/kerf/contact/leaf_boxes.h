// Boxes of the faces, or of the edges, in the leaves of a body's tree, eight at a time: most of what a vertex or an edge might touch in a
// leaf that is near is left out by them. Leaves are filled as they are asked for.
#pragma once

#include <bit>
#include <cstdint>
#include <vector>

#include "kerf/base/eight.h"
#include "kerf/contact/surface_tree.h"

namespace kerf {

/// Eight boxes; unused ones, at the end, are far away.
struct BoxBlock {
  Eight min[3], max[3];
};
/// Bit i: box i is within the root of `square` of a point.
unsigned near_point(const BoxBlock& block, const TreeCorner& p, float square);
/// Bit i: box i is at most `reach` (at least 0) apart from another one along every axis.
unsigned near_box(const BoxBlock& block, const TreeBox& box, float reach);
/// Bit i: side_by_side() does not hold for `a` and box i, whose directions are in `directions`.
unsigned not_side_by_side(const TreeBox& a, const TreeBox& a_directions, const BoxBlock& block,
                          const TreeBox& directions, float limit);

/// Eight leaves of a body's tree: their boxes, and those of the directions in them. Unused ones, at the end, are far away.
struct LeafBlock {
  Eight min[3], max[3];
  Eight centre[3], width[3], size;  ///< of the directions: middle, half width; longest offset, m
};
LeafBlock no_leaves();
void set_leaf(const TreeBox& box, const TreeBox& directions, std::size_t i, LeafBlock& block);
/// Bit i: something in leaf i may be what near_point() and not_side_by_side() select, together: none of that is left out.
unsigned leaves_near_point(const LeafBlock& block, const TreeCorner& p, const TreeCorner& direction, float square,
                           float limit);
/// The same of near_box() and not_side_by_side().
unsigned leaves_near_box(const LeafBlock& block, const TreeBox& a, const TreeBox& a_directions, float reach,
                         float limit);

/// The edges in eight boxes.
struct SegmentBlock {
  Eight a[3], along[3];  ///< first end, and from there to the other, m
  Eight square, size;    ///< of the length, and the sum of its coordinates' sizes
  EightBits from, to;    ///< their vertices
  unsigned rims = 0;     ///< bit i: edge i was made by a cut
};
/// An edge that blocks are asked about.
struct SegmentProbe {
  TreeCorner a, b;
  std::int32_t from = -1, to = -1;  ///< what has one of these vertices as well is left out; -1: nothing is
  float slack = 0;                  ///< TreeBoxes::slack of both sides
};
/// Bit i: the edge may be nearest to edge i inside of both, as inner_feet() has it.
unsigned may_have_inner_feet(const SegmentBlock& block, const SegmentProbe& probe);

struct LeafBoxes {
  struct Range {
    std::uint32_t begin = 0, end = 0, block = 0;  ///< items of a leaf, and its first block
    bool listed = false;
  };
  std::vector<std::int32_t> item;  ///< numbers of faces or edges
  std::vector<TreeBox> box;        ///< of the items
  std::vector<BoxBlock> block;
  std::vector<Range> leaf;  ///< per node

  /// Nothing is listed.
  void clear(std::size_t nodes);
  /// Lists a leaf, unless it is: fill(add) calls add(item, box) for all that it holds.
  template <class Fill>
  void list(std::uint32_t n, Fill&& fill) {
    if (leaf[n].listed) return;
    leaf[n] = {static_cast<std::uint32_t>(item.size()), 0, static_cast<std::uint32_t>(block.size()), true};
    fill([&](std::int32_t i, const TreeBox& b) { add(leaf[n].begin, i, b); });
    leaf[n].end = static_cast<std::uint32_t>(item.size());
  }
  /// Calls visit(position in `item`) for all items of a leaf whose bit select(number of a block) sets, in order.
  template <class Select, class Visit>
  void for_each(std::uint32_t n, Select&& select, Visit&& visit) const {
    const Range& range = leaf[n];
    for (std::uint32_t at = range.begin, b = range.block; at < range.end; at += 8, ++b) {
      const unsigned used =
          range.end - at < 8 ? (1u << (range.end - at)) - 1 : 0xff;  // nothing is far from what is not a number
      for (unsigned bits = select(b) & used; bits != 0; bits &= bits - 1)
        visit(at + static_cast<std::uint32_t>(std::countr_zero(bits)));
    }
  }

 private:
  void add(std::uint32_t begin, std::int32_t i, const TreeBox& b);
};
struct LeafEdges : LeafBoxes {
  std::vector<SegmentBlock> ends;  ///< per block

  void clear(std::size_t nodes);
  /// Says what the edge that was added last is.
  void set_last(const TreeCorner& a, const TreeCorner& b, std::int32_t from, std::int32_t to, bool rim,
                std::uint32_t n);
};

}  // namespace kerf
