// Points of the material inside faces of the collision mesh: they stay where they are when faces around them are divided.
#pragma once

#include <array>
#include <span>

#include "kerf/binding/cell_complex.h"

namespace kerf {

/// A point of the collision mesh: barycentric weights (sum 1, >= 0) at the corners of a triangle.
struct FacePoint {
  CollisionTriangle face;
  std::array<double, 3> weights{};
};

/// A point of the material.
struct RestPoint {
  CollisionTriangle face;  ///< the last known one that holds it
  Vec2 at;                 ///< in the plane of the face's root, metres
};

RestPoint rest_point(const CollisionMesh& mesh, const FacePoint& point);
/// Barycentric in its face; a point that rounding has put outside is drawn in.
std::array<double, 3> weights_of(const CollisionMesh& mesh, const RestPoint& point);
/// Where it is, given where all collision vertices are, metres.
Vec3 place_of(const CollisionMesh& mesh, const RestPoint& point, std::span<const Vec3> vertices);

/// In the plane of a face's root: of a place at rest, seen straight along the face's normal.
Vec2 planar_of(const CollisionMesh& mesh, CollisionTriangle face, Vec3 rest);

/// Finds the face that holds a point now: the last known one, if it still does, else one of the same root around a vertex if one is given, else one
/// around the last known one. Rounding may leave a point `outside` metres out of all of them. False: none.
bool find_face(const CollisionMesh& mesh, RestPoint& point, CollisionVertex around, double outside);

/// Is a vertex a corner of a face?
bool has_corner(const CollisionMesh& mesh, CollisionTriangle face, CollisionVertex v);

/// What a vertex that is made at a point of the material would be too near to, in its face.
struct NearInFace {
  CollisionVertex corner;  ///< the nearest, inside the material or the one asked for
  CollisionHalfEdge edge;  ///< if there is no such corner: the nearest edge inside the material
  double fraction = 0;     ///< of that edge
  double distance = 0;     ///< metres from either; 0 if nothing is near
};

/// Nearer than `reach` metres. `own`: a corner that counts though it be on a border, or none.
NearInFace near_in_face(const CollisionMesh& mesh, const RestPoint& point, double reach, CollisionVertex own);

}  // namespace kerf
