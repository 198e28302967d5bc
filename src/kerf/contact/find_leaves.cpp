// Which leaves of a body's tree come near a part of a shape.
#include <algorithm>
#include <cmath>

#include "kerf/contact/detect_scratch.h"

namespace kerf {
namespace {

/// Leaves whose box `near(box)` holds for, and of all boxes above them.
template <class Near>
void descend(const SurfaceTree& tree, const TreeBoxes& boxes, DetectScratch& scratch, Near&& near) {
  auto& stack = scratch.stack;
  stack.assign(1, 0);
  while (!stack.empty()) {
    const std::uint32_t n = stack.back();
    stack.pop_back();
    if (!near(boxes.box[n])) continue;
    const SurfaceTreeNode node = tree.nodes[n];
    if (node.count > 0) {
      scratch.leaves.push_back(n);
    } else {
      stack.push_back(node.first + 1);
      stack.push_back(node.first);
    }
  }
}

struct Centred {
  Vec3 centre, half;
};
Centred centred(const TreeBox& b) {
  const Vec3 lo{b.min.x[0], b.min.x[1], b.min.x[2]}, hi{b.max.x[0], b.max.x[1], b.max.x[2]};
  return {0.5 * (lo + hi), 0.5 * (hi - lo)};
}

void near_plane(const SurfaceTree& tree, const TreeBoxes& boxes, const PlacedPart& part, double reach,
                DetectScratch& scratch) {
  const Vec3 n = part.axes.c[2], size = absolute(n);
  descend(tree, boxes, scratch, [&](const TreeBox& box) {
    const Centred c = centred(box);
    return dot(n, c.centre - part.centre) - dot(size, c.half) < reach;
  });
}

void near_box(const SurfaceTree& tree, const TreeBoxes& boxes, const Box3& target, double reach,
              DetectScratch& scratch) {
  const TreeBox other{to_corner(target.min), to_corner(target.max)};
  const auto r = static_cast<float>(reach);
  descend(tree, boxes, scratch, [&](const TreeBox& box) { return near(box, other, r); });
}

}  // namespace

void find_leaves(const SurfaceTree& tree, const TreeBoxes& boxes, const PlacedPart& part, double reach,
                 DetectScratch& scratch) {
  scratch.leaves.clear();
  if (tree.empty()) return;
  // Boxes are rounded, those of the part as well.
  Box3 target;
  target.add(part.centre);
  switch (part.part->kind) {
    case PartKind::kPlane: near_plane(tree, boxes, part, reach + boxes.slack, scratch); return;
    case PartKind::kMesh: return;
    case PartKind::kCapsule: target.add(part.end); break;
    case PartKind::kBox: {
      const Vec3 h = part.part->half;
      const Vec3 half =
          h.x * absolute(part.axes.c[0]) + h.y * absolute(part.axes.c[1]) + h.z * absolute(part.axes.c[2]);
      target.add(part.centre - half);
      target.add(part.centre + half);
      break;
    }
    case PartKind::kSphere: break;
  }
  const double rounding = 1e-6 * (norm(target.min) + norm(target.max));
  near_box(tree, boxes, target, reach + part.part->radius + boxes.slack + rounding, scratch);
}

}  // namespace kerf
