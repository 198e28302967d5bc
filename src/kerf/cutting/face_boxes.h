// Boxes of the collision triangles where they are now, so that a blade looks only at what it comes near.
//
// Sixteen triangles that follow each other make a group, sixteen groups one of the next level, and so on. Numbers hardly
// ever lie far from their neighbours: a mesh is numbered in patches or rows, and what a cut makes comes one after the other. So no tree
// has to be built or balanced, and triangles are always met in rising order.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "kerf/base/vec.h"
#include "kerf/binding/cell_complex.h"

namespace kerf {

class FaceBoxes {
 public:
  /// Nothing holds any more: positions have changed, or the mesh is another.
  void forget() {
    levels_.clear();
    stale_.clear();
    faces_ = 0;
  }
  /// A triangle has other corners or other positions. New ones need not be told.
  void mark(CollisionTriangle f) {
    if (f.index() < faces_) stale_.push_back(f.value / kGroup);
  }
  /// Triangles from this number on are gone; others may take their numbers.
  void shrink(std::size_t faces) {
    if (faces >= faces_) return;
    faces_ = faces;
    if (faces > 0) mark(CollisionTriangle(faces - 1));
  }
  /// Brings all boxes up to date. `position` of every vertex, metres. Cost: proportional to what has changed; everything after forget().
  void refresh(const CollisionMesh& mesh, std::span<const Vec3> position);

  /// Calls fn(triangle) for all triangles, by rising number, but for those of groups whose box meets(box) denies.
  template <class Meets, class Fn>
  void for_each(Meets&& meets, Fn&& fn) const {
    if (!levels_.empty()) visit(levels_.size() - 1, 0, levels_.back().size(), meets, fn);
  }

 private:
  static constexpr std::int32_t kGroup = 16;

  template <class Meets, class Fn>
  void visit(std::size_t level, std::size_t first, std::size_t last, Meets&& meets, Fn&& fn) const {
    const std::size_t below = level > 0 ? levels_[level - 1].size() : faces_;
    for (std::size_t i = first; i < last; ++i) {
      if (!meets(levels_[level][i])) continue;
      const std::size_t begin = i * kGroup, end = std::min(begin + kGroup, below);
      if (level > 0) visit(level - 1, begin, end, meets, fn);
      else
        for (std::size_t f = begin; f < end; ++f) fn(CollisionTriangle(f));
    }
  }

  std::vector<std::vector<Box3>> levels_;  ///< the first: of groups of triangles; the last has at most kGroup
  std::vector<std::int32_t> stale_;        ///< groups of the first level
  std::size_t faces_ = 0;
};

/// Do two boxes have a point in common? An empty one has none.
inline bool boxes_meet(const Box3& a, const Box3& b) {
  return a.min.x <= b.max.x && b.min.x <= a.max.x && a.min.y <= b.max.y && b.min.y <= a.max.y && a.min.z <= b.max.z &&
         b.min.z <= a.max.z;
}

}  // namespace kerf
