// How far the vertices of a body are from a rigid mesh at least, from what was found in earlier steps: a ball that holds nothing of the mesh says so
// until its vertex has left it. Only saves time: what a ball says is true whoever asks, and for whatever vertex.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "kerf/base/ids.h"
#include "kerf/contact/obstacle_mesh.h"
#include "kerf/contact/surface_tree.h"

namespace kerf {

class Clearance {
 public:
  /// Of this mesh from now on: forgets everything if it was another one.
  void is_of(const std::shared_ptr<const ObstacleMesh>& mesh, std::size_t vertices);
  /// m from the mesh to a vertex that is at `local` in its frame, or less.
  [[nodiscard]] double least(CollisionVertex v, Vec3 local) const;
  /// Nothing of the mesh is nearer than `distance` to this place, and this triangle as near, if any.
  void set(CollisionVertex v, Vec3 local, double distance, const ObstacleLeaves::Triangle* nearest);
  /// The triangle that was nearest when last asked, or null.
  [[nodiscard]] const ObstacleLeaves::Triangle* guess(CollisionVertex v) const {
    const std::int32_t i = nearest_[v.index()];
    return i < 0 ? nullptr : &mesh_->leaves.triangles[static_cast<std::size_t>(i)];
  }

 private:
  std::shared_ptr<const ObstacleMesh> mesh_;
  double size_ = 0;                    ///< of the mesh and where it lies: rounding is measured by it, m
  std::vector<TreeCorner> ball_;       ///< per vertex: centre and radius, m
  std::vector<std::int32_t> nearest_;  ///< per vertex: place in ObstacleLeaves::triangles, or -1
};

}  // namespace kerf
