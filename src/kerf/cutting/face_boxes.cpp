#include "kerf/cutting/face_boxes.h"

#include <cmath>

namespace kerf {
namespace {

void add(Box3& box, const Box3& other) {
  box.min = {std::min(box.min.x, other.min.x), std::min(box.min.y, other.min.y), std::min(box.min.z, other.min.z)};
  box.max = {std::max(box.max.x, other.max.x), std::max(box.max.y, other.max.y), std::max(box.max.z, other.max.z)};
}

/// Four doubles in a vector register (of g++ and clang; two smaller ones where the machine has none so wide).
using Lanes = double __attribute__((vector_size(4 * sizeof(double))));

/// The box of the vertices that half-edges [first, last) start at.
Box3 box_of(const CollisionMesh& mesh, std::span<const Vec3> position, std::size_t first, std::size_t last) {
  Lanes low = Lanes{} + HUGE_VAL, high = Lanes{} - HUGE_VAL;
  for (std::size_t h = first; h < last; ++h) {
    const Vec3& p = position[mesh.origin[CollisionHalfEdge(h)].index()];
    const Lanes x{p.x, p.y, p.z, 0};
    low = x < low ? x : low;
    high = high < x ? x : high;
  }
  return {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
}

}  // namespace

void FaceBoxes::refresh(const CollisionMesh& mesh, std::span<const Vec3> position) {
  const std::size_t before = faces_;
  faces_ = mesh.face_count();
  const auto group_count = [](std::size_t n) { return (n + kGroup - 1) / kGroup; };
  // New groups, and those that the mesh ends or ended in.
  if (faces_ != before) {
    const std::size_t least = std::min(before, faces_);
    for (std::size_t g = least > 0 ? (least - 1) / kGroup : 0; g < group_count(faces_); ++g) stale_.push_back(static_cast<std::int32_t>(g));
  }
  std::size_t size = faces_;
  for (std::size_t level = 0; size > 0; ++level) {
    size = group_count(size);
    if (levels_.size() <= level) {
      levels_.emplace_back();
      if (level > 0)  // a level more than there was: all of it
        for (std::size_t g = 0; g < size; ++g) stale_.push_back(static_cast<std::int32_t>(g));
    }
    levels_[level].resize(size);
    if (!std::is_sorted(stale_.begin(), stale_.end())) std::sort(stale_.begin(), stale_.end());
    stale_.erase(std::unique(stale_.begin(), stale_.end()), stale_.end());
    for (const std::int32_t group : stale_) {
      const auto g = static_cast<std::size_t>(group);
      if (g >= size) continue;
      Box3 box;
      if (level == 0) {
        box = box_of(mesh, position, 3 * kGroup * g, std::min(3 * kGroup * (g + 1), 3 * faces_));
      } else {
        const auto& below = levels_[level - 1];
        for (std::size_t i = kGroup * g; i < std::min(kGroup * (g + 1), below.size()); ++i) add(box, below[i]);
      }
      levels_[level][g] = box;
    }
    for (std::int32_t& group : stale_) group /= kGroup;
    if (size <= kGroup) {
      levels_.resize(level + 1);
      break;
    }
  }
  if (faces_ == 0) levels_.clear();
  stale_.clear();
}

}  // namespace kerf
