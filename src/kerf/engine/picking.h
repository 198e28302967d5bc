// What a view ray meets of the body as it is now.
#pragma once

#include <array>
#include <optional>
#include <span>

#include "kerf/binding/cell_complex.h"

namespace kerf {

struct Picked {
  CollisionTriangle triangle;
  std::array<double, 3> barycentric{};
  double t = 0;       ///< metres along the ray to `point`
  Vec3 middle;        ///< on the collision mesh, metres
  Vec3 point;         ///< half the thickness before it, where the skin is about to be
  Vec3 normal;        ///< unit, of the collision triangle, counter-clockwise
  Vec3 rest;          ///< of `middle`
  double half = 0;    ///< metres: half the thickness there
  double beside = 0;  ///< metres by which the ray passes the body (pick_near)
};

/// The first collision triangle that the ray (unit direction) meets at these deformed positions; none when it passes by.
/// Linear in the collision mesh.
std::optional<Picked> pick(const CollisionMesh& mesh, std::span<const Vec3> positions, Vec3 origin, Vec3 direction);

/// As pick; a ray that passes the body by less than `near` metres meets the nearest edge. `middle` and `rest` are then on the
/// body, nearest to the ray, and `point` is where the ray would meet the skin if this went on.
std::optional<Picked> pick_near(const CollisionMesh& mesh, std::span<const Vec3> positions, Vec3 origin, Vec3 direction,
                                double near);

}  // namespace kerf
