// Triangles as the spatial queries see them: positions and three corner indices each, whoever owns them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "kerf/base/ids.h"
#include "kerf/base/vec.h"
#include "kerf/mesh/triangle_mesh.h"

namespace kerf {

struct TriangleView {
  std::span<const Vec3> positions;        ///< |V|, metres
  std::span<const std::int32_t> corners;  ///< 3 |F|

  TriangleView(std::span<const Vec3> points, std::span<const std::int32_t> corner_indices)
      : positions(points), corners(corner_indices) {}
  /// Corners given by typed ids, e.g. the origins of half-edges.
  template <class Tag>
  TriangleView(std::span<const Vec3> points, std::span<const Id<Tag>> corner_ids)
      : positions(points), corners(raw(corner_ids.data()), corner_ids.size()) {}
  TriangleView(const TriangleMesh& mesh)
      : positions(mesh.positions.raw()),
        corners(mesh.triangles.empty() ? nullptr : raw(mesh.triangles.raw()[0].data()), 3 * mesh.triangles.size()) {}

  [[nodiscard]] std::size_t size() const { return corners.size() / 3; }
  [[nodiscard]] std::array<Vec3, 3> operator[](std::int32_t triangle) const {
    const std::size_t c = 3 * static_cast<std::size_t>(triangle);
    return {at(c), at(c + 1), at(c + 2)};
  }

 private:
  [[nodiscard]] Vec3 at(std::size_t corner) const { return positions[static_cast<std::size_t>(corners[corner])]; }
  // An id is one index and nothing else, so an array of ids can be read as an array of indices.
  template <class Tag>
  static const std::int32_t* raw(const Id<Tag>* first) {
    static_assert(sizeof(Id<Tag>) == sizeof(std::int32_t));
    return first == nullptr ? nullptr : &first->value;
  }
};

}  // namespace kerf
