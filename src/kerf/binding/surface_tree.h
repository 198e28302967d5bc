// A tree of boxes over the faces of a triangle surface, for the rays and closest points of 4.1.1.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "kerf/base/vec.h"

namespace kerf {

/// A point of the surface.
struct SurfacePoint {
  std::int32_t face = -1;
  Vec3 position;
  double distance = 0;  ///< from the query point, metres
};

/// Boxes over groups of faces in Morton order, as an implicit binary tree (about 16 bytes a face). Refers to the mesh it
/// was built from.
class SurfaceTree {
 public:
  SurfaceTree(std::span<const Vec3> positions, std::span<const std::array<std::int32_t, 3>> triangles);

  /// The point nearest to p on faces whose normal n has dot(n, facing) > 0 (all faces if facing is zero), not farther than reach.
  [[nodiscard]] std::optional<SurfacePoint> closest(Vec3 p, Vec3 facing, double reach) const;

  /// The first hit of the ray from `origin` along the unit vector `direction` on a face that looks the same way
  /// (dot(n, direction) > 0), within reach.
  [[nodiscard]] std::optional<SurfacePoint> first_exit(Vec3 origin, Vec3 direction, double reach) const;

 private:
  struct Box {
    std::array<float, 3> min, max;
  };
  [[nodiscard]] std::array<Vec3, 3> corners(std::int32_t f) const;
  std::span<const Vec3> positions_;
  std::span<const std::array<std::int32_t, 3>> triangles_;
  std::vector<std::int32_t> order_;  ///< faces in Morton order; leaf i holds order_[4 i .. 4 i + 3]
  std::vector<Box> boxes_;           ///< heap: children of i are 2 i + 1 and 2 i + 2
  std::size_t leaves_ = 0;           ///< a power of two
};

/// Nearest point to p on triangle abc.
Vec3 closest_on_triangle(Vec3 p, Vec3 a, Vec3 b, Vec3 c);

}  // namespace kerf
