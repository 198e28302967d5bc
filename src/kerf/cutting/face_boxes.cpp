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

void sort_unique(std::vector<std::int32_t>& list) {
  if (!std::is_sorted(list.begin(), list.end())) std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

}  // namespace

void FaceBoxes::forget() {
  groups_.clear();
  unused_.clear();
  group_of_.clear();
  last_.clear();
  levels_.clear();
  stale_groups_.clear();
  stale_.clear();
}

void FaceBoxes::append(std::int32_t face, std::int32_t root) {
  if (last_.size() <= static_cast<std::size_t>(root)) last_.resize(static_cast<std::size_t>(root) + 1, -1);
  std::int32_t& last = last_[static_cast<std::size_t>(root)];
  if (last < 0 || groups_[static_cast<std::size_t>(last)].count == kGroup) {
    std::int32_t made = static_cast<std::int32_t>(groups_.size());
    if (unused_.empty()) {
      groups_.emplace_back();
    } else {
      made = unused_.back();
      unused_.pop_back();
    }
    Group& group = groups_[static_cast<std::size_t>(made)];
    group.root = root;
    group.before = last;
    last = made;
  }
  Group& group = groups_[static_cast<std::size_t>(last)];
  group.faces[static_cast<std::size_t>(group.count++)] = face;
  group_of_.push_back(last);
  stale_groups_.push_back(last);
}

void FaceBoxes::shrink(std::size_t faces) {
  // Each is the last of its root's last group.
  while (group_of_.size() > faces) {
    const std::int32_t g = group_of_.back();
    group_of_.pop_back();
    Group& group = groups_[static_cast<std::size_t>(g)];
    --group.count;
    stale_groups_.push_back(g);
    if (group.count > 0) continue;
    last_[static_cast<std::size_t>(group.root)] = group.before;
    stale_.push_back(group.root);
    unused_.push_back(g);
  }
}

void FaceBoxes::refresh(const CollisionMesh& mesh, std::span<const Vec3> position) {
  shrink(mesh.face_count());
  for (std::size_t f = group_of_.size(); f < mesh.face_count(); ++f)
    append(static_cast<std::int32_t>(f), mesh.root[CollisionTriangle(f)].value);
  sort_unique(stale_groups_);
  for (const std::int32_t g : stale_groups_) {
    Group& group = groups_[static_cast<std::size_t>(g)];
    if (group.count == 0) continue;
    Lanes low = Lanes{} + HUGE_VAL, high = Lanes{} - HUGE_VAL;
    for (std::int32_t i = 0; i < group.count; ++i)
      for (int k = 0; k < 3; ++k) {
        const CollisionTriangle face(group.faces[static_cast<std::size_t>(i)]);
        const Vec3& p = position[mesh.origin[CollisionMesh::corner(face, k)].index()];
        const Lanes x{p.x, p.y, p.z, 0};
        low = x < low ? x : low;
        high = high < x ? x : high;
      }
    group.box = {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
    stale_.push_back(group.root);
  }
  stale_groups_.clear();
  refresh_levels();
}

void FaceBoxes::refresh_levels() {
  const auto above = [](std::size_t n) { return (n + kGroup - 1) / kGroup; };
  std::size_t size = last_.size();
  for (std::size_t level = 0; size > 0; ++level, size = above(size)) {
    if (levels_.size() <= level) {
      levels_.emplace_back();
      stale_.clear();
      for (std::size_t i = 0; i < size; ++i)
        stale_.push_back(static_cast<std::int32_t>(i));  // a level more than there was: all of it
    }
    levels_[level].resize(size);
    sort_unique(stale_);
    for (const std::int32_t number : stale_) {
      const auto i = static_cast<std::size_t>(number);
      Box3 box;
      if (level == 0) {
        for (std::int32_t g = last_[i]; g >= 0; g = groups_[static_cast<std::size_t>(g)].before)
          add(box, groups_[static_cast<std::size_t>(g)].box);
      } else {
        const std::vector<Box3>& below = levels_[level - 1];
        for (std::size_t k = kGroup * i; k < std::min(kGroup * (i + 1), below.size()); ++k) add(box, below[k]);
      }
      levels_[level][i] = box;
    }
    for (std::int32_t& number : stale_) number /= kGroup;
    if (size <= kGroup) break;
  }
  stale_.clear();
}

}  // namespace kerf
