// Rigid things that bodies touch: obstacles and tools. A shape is a compound of parts that share one pose.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/base/vec.h"
#include "kerf/contact/obstacle_mesh.h"

namespace kerf {

enum class PartKind : std::uint8_t { kPlane, kSphere, kCapsule, kBox, kMesh };

/// One part, in the frame of its shape, metres. Made by the functions below.
struct ShapePart {
  PartKind kind = PartKind::kSphere;
  Vec3 centre;        ///< sphere, box; plane: a point of it; capsule: its first end; mesh: where its origin lies
  Vec3 end;           ///< capsule: the other end
  Mat3 axes;          ///< box, mesh: turned by this; plane: the third column is the normal
  Vec3 half;          ///< box: half its sizes, without the rounding
  double radius = 0;  ///< sphere, capsule; box: of its rounded edges, added to the sizes
  std::shared_ptr<const ObstacleMesh> mesh;
};

/// The half-space below a plane whose normal (any length but zero) points up.
ShapePart plane_part(Vec3 point, Vec3 normal);
ShapePart sphere_part(Vec3 centre, double radius);
ShapePart capsule_part(Vec3 a, Vec3 b, double radius);
ShapePart box_part(Vec3 centre, Vec3 half_sizes, const Mat3& axes = {}, double rounding = 0);
ShapePart mesh_part(std::shared_ptr<const ObstacleMesh> mesh, Vec3 origin = {}, const Mat3& axes = {});

/// A compound with its pose at the start of a step and its motion during it. What doesn't move costs nothing to keep.
struct RigidShape {
  std::vector<ShapePart> parts;
  Vec3 position;        ///< of its frame, m
  Mat3 axes;            ///< columns: its axes in the world, orthonormal, right-handed
  Vec3 velocity;        ///< m/s, of the frame's origin
  Vec3 spin;            ///< rad/s, world
  double friction = 0;  ///< Coulomb's coefficient against bodies

  /// Velocity of the shape's material at a place in the world, m/s.
  [[nodiscard]] Vec3 velocity_at(Vec3 p) const { return velocity + cross(spin, p - position); }
};

/// Bad input: numbers that are not finite, negative sizes, axes that are not orthonormal, a mesh part without a mesh.
Status validate_shape(const RigidShape& shape);

/// The least of the parts' radii (half sizes of a box; 0 for a mesh; HUGE_VAL for planes alone), metres.
double thinnest_radius(const RigidShape& shape);
/// An upper bound of the speed of any of its points, m/s. Planes and spin: of the part's own point.
double greatest_speed(const RigidShape& shape);

/// A part in the world, as the queries see it.
struct PlacedPart {
  const ShapePart* part = nullptr;
  Vec3 centre, end;
  Mat3 axes;
};
PlacedPart place(const RigidShape& shape, const ShapePart& part);

/// The surface point of a part nearest to a point x: x = point + distance normal.
struct Proximity {
  Vec3 point, normal;      ///< m; unit, out of the part
  double distance = 0;     ///< m, negative inside
  bool two_sided = false;  ///< an open mesh: the normal points to the side that x is on, whichever that is
};
/// False if x is farther than `reach` metres outside, or that far inside a mesh. If several places of a box or mesh are
/// nearest it is the first of them.
bool closest_on_part(const PlacedPart& part, Vec3 x, double reach, Proximity& result);
/// Distance of x from the plane that a part (not a mesh) touches from below with this outward normal (unit): how far x is
/// from leaving the part in that direction, negative inside.
double distance_along(const PlacedPart& part, Vec3 x, Vec3 normal);
/// closest_on_part for a mesh part whose nearest point, in its own frame, is known. local: x in that frame.
void proximity_of_foot(const PlacedPart& part, Vec3 local, const ClosestPoint& foot, Proximity& result);

}  // namespace kerf
