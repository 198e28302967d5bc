// How far a rough wall may stray: not into the wall in front of it, nor, in a corner, into the one beside it.
//
//        ------------------  border in front
//             ^ stray
//      =======o===========   lip, outwards is up
//       \\ corner: less the nearer to it
//
#pragma once

#include <span>

#include "kerf/binding/cell_complex.h"

namespace kerf {

struct BorderSegment {
  Vec3 a, b;  ///< metres, at rest
};

/// A place of a wall.
struct WallPlace {
  Vec3 foot;             ///< metres: on its border edge
  double across = 0;     ///< 0 at the + chain, 1 at the - chain
  bool on_line = false;  ///< of an end of the border edge: shared with the wall beyond
};

/// Metres; HUGE_VAL where nothing is near. `lip`: the wall's border edge; `outward`: unit, where it strays; `borders`: of the material there. Those that share
/// an end with the edge are its corners.
double wall_room(const CollisionMesh& mesh, CollisionHalfEdge lip, Vec3 outward, const WallPlace& place,
                 std::span<const BorderSegment> borders);

/// The point of a border edge that is nearest to a place, as the foot of a WallPlace.
Vec3 foot_on(const CollisionMesh& mesh, CollisionHalfEdge border, Vec3 place);

}  // namespace kerf
