// Boxes of the collision triangles where they are now, so that a blade looks only at what it comes near.
//
// Triangles are kept by the root triangle that they were cut out of, sixteen to a group: what cuts make in one place stays together,
// however many cuts elsewhere came in between. Sixteen roots that follow each other make one of the next level, and so on; numbers of roots
// hardly ever lie far from their neighbours, as a mesh is numbered in patches or rows. So no tree has to be built or balanced.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "kerf/base/vec.h"
#include "kerf/binding/cell_complex.h"

namespace kerf {

class FaceBoxes {
 public:
  /// Nothing holds any more: positions have changed, or the mesh is another.
  void forget();
  /// A triangle has other corners or other positions; its root is the same. New ones need not be told.
  void mark(CollisionTriangle f) {
    if (f.index() < group_of_.size()) stale_groups_.push_back(group_of_[f.index()]);
  }
  /// Triangles from this number on are gone; others may take their numbers.
  void shrink(std::size_t faces);
  /// Brings all boxes up to date. `position` of every vertex, metres. Cost: proportional to what has changed; everything after forget().
  void refresh(const CollisionMesh& mesh, std::span<const Vec3> position);

  /// Calls fn(triangle) for all triangles, by rising number, but for those of groups whose box meets(box) denies.
  template <class Meets, class Fn>
  void for_each(Meets&& meets, Fn&& fn) const {
    if (levels_.empty()) return;
    std::vector<std::int32_t> met = std::exchange(met_, {});  // not in the hands of fn
    met.clear();
    collect(levels_.size() - 1, 0, levels_.back().size(), meets, met);
    std::sort(met.begin(), met.end());
    for (const std::int32_t f : met) fn(CollisionTriangle(f));
    met_ = std::move(met);
  }

 private:
  static constexpr std::int32_t kGroup = 16;

  /// Some triangles of one root, by rising number.
  struct Group {
    Box3 box;
    std::array<std::int32_t, kGroup> faces{};
    std::int32_t count = 0;
    std::int32_t root = -1;
    std::int32_t before = -1;  ///< the root's group before this one
  };

  void append(std::int32_t face, std::int32_t root);
  void refresh_levels();

  template <class Meets>
  void collect(std::size_t level, std::size_t first, std::size_t last, Meets&& meets,
               std::vector<std::int32_t>& met) const {
    for (std::size_t i = first; i < last; ++i) {
      if (!meets(levels_[level][i])) continue;
      if (level > 0) {
        collect(level - 1, i * kGroup, std::min((i + 1) * kGroup, levels_[level - 1].size()), meets, met);
        continue;
      }
      if (last_[i] < 0) continue;
      const bool only = groups_[static_cast<std::size_t>(last_[i])].before < 0;  // has the box of its root
      for (std::int32_t g = last_[i]; g >= 0; g = groups_[static_cast<std::size_t>(g)].before) {
        const Group& group = groups_[static_cast<std::size_t>(g)];
        if (only || meets(group.box)) met.insert(met.end(), group.faces.begin(), group.faces.begin() + group.count);
      }
    }
  }

  std::vector<Group> groups_;
  std::vector<std::int32_t> unused_;    ///< groups without triangles
  std::vector<std::int32_t> group_of_;  ///< per triangle
  std::vector<std::int32_t> last_;      ///< per root: the latest of its groups, or -1
  std::vector<std::vector<Box3>>
      levels_;  ///< the first: of roots, empty where nothing is left of one; the last has at most kGroup
  std::vector<std::int32_t> stale_groups_, stale_;  ///< of groups; of the first level
  mutable std::vector<std::int32_t> met_;           ///< memory of for_each
};

/// Do two boxes have a point in common? An empty one has none.
inline bool boxes_meet(const Box3& a, const Box3& b) {
  return a.min.x <= b.max.x && b.min.x <= a.max.x && a.min.y <= b.max.y && b.min.y <= a.max.y && a.min.z <= b.max.z &&
         b.min.z <= a.max.z;
}

}  // namespace kerf
