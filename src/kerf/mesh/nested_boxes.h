// Which of many boxes hold a box? A tree of boxes that hold their children.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "kerf/base/vec.h"

namespace kerf {

class NestedBoxes {
 public:
  struct Item {
    Box3 box;
    std::size_t number = 0;
  };
  explicit NestedBoxes(std::vector<Item> items) : items_(std::move(items)), around_(2 * items_.size() + 1) {
    if (!items_.empty()) build(0, items_.size(), 0);
  }

  /// Calls f(number) for each box that holds this one, itself included, in no order. Cost: near log n where few boxes overlap.
  template <class F>
  void for_each_around(const Box3& box, F&& f) const {
    if (!items_.empty()) visit(0, items_.size(), 0, box, f);
  }

 private:
  static bool holds(const Box3& out, const Box3& in) {
    return in.min.x >= out.min.x && in.min.y >= out.min.y && in.min.z >= out.min.z && in.max.x <= out.max.x &&
           in.max.y <= out.max.y && in.max.z <= out.max.z;
  }
  /// The children of a node stand behind it: the first one's nodes, as many as twice its items less one, then the second one's.
  static std::size_t second(std::size_t node, std::size_t begin, std::size_t middle) {
    return node + 2 * (middle - begin);
  }

  void build(std::size_t begin, std::size_t end, std::size_t node) {
    Box3 all;
    for (std::size_t i = begin; i < end; ++i) {
      all.add(items_[i].box.min);
      all.add(items_[i].box.max);
    }
    around_[node] = all;
    if (end - begin == 1) return;
    const Vec3 size = all.size();
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::size_t middle = begin + (end - begin) / 2;
    const auto at = [&](std::size_t i) { return items_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(begin), at(middle), at(end), [axis](const Item& a, const Item& b) {
      return a.box.min[axis] + a.box.max[axis] < b.box.min[axis] + b.box.max[axis];
    });
    build(begin, middle, node + 1);
    build(middle, end, second(node, begin, middle));
  }
  template <class F>
  void visit(std::size_t begin, std::size_t end, std::size_t node, const Box3& box, F& f) const {
    if (!holds(around_[node], box)) return;
    if (end - begin == 1) return f(items_[begin].number);
    const std::size_t middle = begin + (end - begin) / 2;
    visit(begin, middle, node + 1, box, f);
    visit(middle, end, second(node, begin, middle), box, f);
  }

  std::vector<Item> items_;
  std::vector<Box3> around_;  ///< of nodes
};

}  // namespace kerf
