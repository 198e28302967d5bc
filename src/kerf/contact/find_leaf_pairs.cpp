// Which leaves of two bodies' trees, or of one body's, come near each other.
#include <algorithm>
#include <cmath>

#include "kerf/contact/detect_scratch.h"

namespace kerf {
namespace {

/// May two nodes of one body be left out: neighbours, or hardly bent? Then what lies close at rest can't have met, unless a cut runs through
/// one of them: its far side may have come over the other.
bool may_skip(const BodyView& body, std::uint32_t n, std::uint32_t m) {
  if (!hang_together(body.surface, n, m)) return false;
  if (all_neighbours(body.surface, n, m)) return true;
  if (body.surface.node_open[n] != 0 || body.surface.node_open[m] != 0) return false;
  const auto& directions = body.frame.directions;
  return is_narrow(joined(directions[n], directions[m])) && any_neighbours(body.surface, n, m);
}

/// By the second, then by the first without mixing up equal ones: O(pairs + nodes).
void sort_pairs(std::size_t nodes, std::size_t other_nodes, DetectScratch& scratch) {
  scratch.sorted_pairs.resize(scratch.leaf_pairs.size());
  for (const std::size_t by : {1u, 0u}) {
    auto& place = scratch.stack;
    place.assign((by == 1 ? other_nodes : nodes) + 1, 0);
    for (const LeafPair& leaves : scratch.leaf_pairs) ++place[leaves[by] + 1];
    for (std::size_t n = 1; n < place.size(); ++n) place[n] += place[n - 1];
    for (const LeafPair& leaves : scratch.leaf_pairs) scratch.sorted_pairs[place[leaves[by]]++] = leaves;
    std::swap(scratch.leaf_pairs, scratch.sorted_pairs);
  }
}

StrayBox stray_of(const BodyView& body, std::uint32_t leaf, const Strayed& strayed) {
  StrayBox box{{HUGE_VAL, HUGE_VAL, HUGE_VAL}, {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, 0};
  body.surface.tree.for_each_triangle(leaf, [&](CollisionTriangle f) {
    for (const CollisionVertex v : body.surface.vertices(f)) {
      const Vec3 d = strayed.position[v.index()];
      for (int k = 0; k < 3; ++k) {
        box.least[k] = std::min(box.least[k], d[k]);
        box.most[k] = std::max(box.most[k], d[k]);
      }
      box.turn = std::max(box.turn, norm(strayed.offset[v.index()]));
    }
  });
  return box;
}

}  // namespace

void leave_out_foreseen(const BodyView& body, const Strayed& strayed, double least, DetectScratch& scratch) {
  auto& boxes = scratch.strays;
  boxes.assign(body.surface.tree.nodes.size(), {});
  const auto box_of = [&](std::uint32_t leaf) -> const StrayBox& {
    if (boxes[leaf].turn < 0) boxes[leaf] = stray_of(body, leaf, strayed);
    return boxes[leaf];
  };
  std::erase_if(scratch.leaf_pairs, [&](const LeafPair& leaves) {
    const StrayBox &a = box_of(leaves[0]), &b = box_of(leaves[1]);
    Vec3 apart;  // the most by which a stray of one differs from a stray of the other
    for (int k = 0; k < 3; ++k) apart[k] = std::max({0.0, a.most[k] - b.least[k], b.most[k] - a.least[k]});
    return !(norm(apart) + a.turn + b.turn > least);
  });
}

bool side_by_side(const TreeBox& a, const TreeBox& a_directions, const TreeBox& b, const TreeBox& b_directions,
                  float limit) {
  // d lies in a box around `middle`.
  const auto absolute = [](TreeLanes v) { return v < TreeLanes{} ? -v : v; };
  const TreeLanes middle = 0.5f * (lanes(a.min) + lanes(a.max) - lanes(b.min) - lanes(b.max));
  const TreeLanes half = 0.5f * (lanes(a.max) - lanes(a.min) + lanes(b.max) - lanes(b.min));
  const TreeLanes farthest = absolute(middle) + half, beyond = greater_of(absolute(middle) - half, TreeLanes{});
  const float square = sum_of_three(beyond * beyond);
  if (!(square > limit * limit)) return false;
  const float distance = std::sqrt(square);
  float gap = distance;
  for (const TreeBox* directions : {&a_directions, &b_directions}) {
    const TreeLanes least = lanes(directions->min), most = lanes(directions->max);
    const TreeLanes centre = 0.5f * (least + most), width = 0.5f * (most - least);
    const float along = sum_of_three(centre * middle);
    const float spread = sum_of_three(absolute(centre) * half + width * farthest);
    gap -= most[3] * std::min(1.0f, (std::fabs(along) + spread) / distance);
  }
  return gap > limit;
}

void find_leaf_pairs(const BodyView& a, const BodyView& b, double reach, double approach, DetectScratch& scratch) {
  auto& found = scratch.leaf_pairs;
  found.clear();
  const SurfaceTree &first = a.surface.tree, &second = b.surface.tree;
  if (first.empty() || second.empty()) return;
  const bool self = a.index == b.index;
  const auto r = static_cast<float>(reach + a.frame.boxes.slack + b.frame.boxes.slack);
  const auto limit = static_cast<float>(approach + a.frame.boxes.slack + b.frame.boxes.slack);
  auto& stack = scratch.pairs;
  stack.assign(1, {0, 0});
  while (!stack.empty()) {
    const auto [n, m] = stack.back();
    stack.pop_back();
    const SurfaceTreeNode one = first.nodes[n], other = second.nodes[m];
    if (self && n == m) {
      if (may_skip(a, n, n)) continue;
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
    if (self && may_skip(a, n, m)) continue;
    if (side_by_side(box, a.frame.directions[n], target, b.frame.directions[m], limit)) continue;
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
  sort_pairs(first.nodes.size(), second.nodes.size(), scratch);
}

}  // namespace kerf
