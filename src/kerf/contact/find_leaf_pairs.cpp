// Which leaves of two bodies' trees, or of one body's, come near each other.
#include <algorithm>

#include "kerf/contact/detect_scratch.h"

namespace kerf {
namespace {

float widest(const TreeBox& b) {
  return std::max({b.max.x[0] - b.min.x[0], b.max.x[1] - b.min.x[1], b.max.x[2] - b.min.x[2]});
}

}  // namespace

void find_leaf_pairs(const BodyView& a, const BodyView& b, double reach, DetectScratch& scratch) {
  auto& found = scratch.leaf_pairs;
  found.clear();
  const SurfaceTree &first = a.surface.tree, &second = b.surface.tree;
  if (first.empty() || second.empty()) return;
  const bool self = a.index == b.index;
  const auto r = static_cast<float>(reach + a.frame.boxes.slack + b.frame.boxes.slack);
  const auto& normals = a.frame.normals;
  auto& stack = scratch.pairs;
  stack.assign(1, {0, 0});
  while (!stack.empty()) {
    const auto [n, m] = stack.back();
    stack.pop_back();
    const SurfaceTreeNode one = first.nodes[n], other = second.nodes[m];
    if (self && n == m) {
      if (is_narrow(normals[n]) && are_neighbours(a.surface, n, n)) continue;
      if (one.count > 0) {
        found.push_back({n, n});
        continue;
      }
      stack.push_back({one.first, one.first + 1});
      stack.push_back({one.first + 1, one.first + 1});
      stack.push_back({one.first, one.first});
      continue;
    }
    const TreeBox &box = a.frame.boxes.box[n], &target = b.frame.boxes.box[m];
    if (!near(box, target, r)) continue;
    if (self && is_narrow(joined(normals[n], normals[m])) && are_neighbours(a.surface, n, m)) continue;
    if (one.count > 0 && other.count > 0) {
      found.push_back({n, m});
      if (self) found.push_back({m, n});
    } else if (other.count > 0 || (one.count == 0 && widest(box) > widest(target))) {
      stack.push_back({one.first + 1, m});
      stack.push_back({one.first, m});
    } else {
      stack.push_back({n, other.first + 1});
      stack.push_back({n, other.first});
    }
  }
  std::sort(found.begin(), found.end());
}

}  // namespace kerf
