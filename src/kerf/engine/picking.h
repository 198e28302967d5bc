// What a view ray meets of the body as it is now.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "kerf/binding/cell_complex.h"

namespace kerf {

struct Picked {
  CollisionTriangle triangle;
  std::array<double, 3> barycentric{};
  double t = 0;       ///< metres along the ray to `point`
  Vec3 middle;        ///< on the collision mesh, metres
  Vec3 point;         ///< where the skin is about to be: half the thickness before it, or on it in an open sheet
  Vec3 normal;        ///< unit, of the collision triangle, counter-clockwise
  Vec3 rest;          ///< of `middle`
  double half = 0;    ///< metres: half the thickness there
  double skin = 0;    ///< metres from the collision mesh to the skin
  double beside = 0;  ///< metres by which the ray passes the body (pick_near)
};

/// The first collision triangle that the ray (unit direction) meets at these deformed positions; none when it passes by.
/// Linear in the collision mesh.
std::optional<Picked> pick(const CollisionMesh& mesh, std::span<const Vec3> positions, Vec3 origin, Vec3 direction);

/// As pick; a ray that passes the body by less than `near` metres meets the nearest edge. `middle` and `rest` are then on the
/// body, nearest to the ray, and `point` is where the ray would meet the skin if this went on.
std::optional<Picked> pick_near(const CollisionMesh& mesh, std::span<const Vec3> positions, Vec3 origin, Vec3 direction,
                                double near);

/// How the body lies around a place at rest: the mean normal of the triangles within `reach` (metres at rest), unit, weighted by area and nearness. A triangle
/// alone may lie any way where a lip springs. Zero where nothing has an area.
Vec3 lie_around(const CollisionMesh& mesh, std::span<const Vec3> positions, Vec3 rest, double reach);

/// Puts `point` of what a ray passes by to where the body would be if it went on with this unit normal. The nearest triangle alone may lie any way
/// where a lip springs.
void go_on(Picked& picked, Vec3 normal, Vec3 origin, Vec3 direction);

/// A place of the skin's rim near a view ray.
struct RimPlace {
  double off = 0;  ///< from the ray, in parts of the distance from the eye
  Vec3 out;        ///< unit, across the ray, towards the place
};
/// The places of all edges of the rim within `reach` (parts of the distance from the eye), the nearest first. The rim lies as far
/// before the collision mesh's border as the skin does.
std::vector<RimPlace> rim_near(const CollisionMesh& mesh, std::span<const Vec3> positions, Vec3 origin, Vec3 direction,
                               double reach);

}  // namespace kerf
