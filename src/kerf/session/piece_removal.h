// Taking a loose piece away, and what it takes to put it back.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "kerf/cutting/validate.h"
#include "kerf/mechanics/mechanics_model.h"
#include "kerf/session/body.h"

namespace kerf {

/// A hold on the body: collision vertices pulled towards places that move together.
struct Grasp {
  std::string id;
  std::vector<CollisionVertex> points;
  std::vector<Vec3> offset;              ///< of each point from the centre, metres, world
  Vec3 centre;                           ///< where the grasp is now
  Vec3 from, to;                         ///< of the present move
  double move_began = 0, move_over = 0;  ///< s
  double stiffness = 0;                  ///< N/m per point
  std::int32_t tool = -1;                ///< of the scene, whose jaws hold; then
  Vec3 local;                            ///< the centre in the tool's axes, and
  Mat3 axes_then;                        ///< the tool's axes when it closed
  Mat3 turned;                           ///< since then: offsets turn with it
  std::vector<SpringId> springs;         ///< one per point
};

/// The other body of an undo step: as it was before the removal, or, once that was undone, as it was after it. What
/// stays has other ids in the two, so they change places as a whole.
struct PieceRemoval {
  Body body;
  ComplexMeasures measures;               ///< what this body should measure
  std::vector<std::uint8_t> fixed;        ///< of its nodes
  std::vector<Vec3> prescribed;           ///< m/s, of its nodes
  std::size_t held_changes = 0;           ///< of HeldRegions, that these know
  std::vector<CollisionVertex> to_other;  ///< of this body's collision vertices: ids in the other; none: not there
  std::vector<std::pair<std::size_t, Grasp>> grasps;  ///< that lost vertices by the removal, with their places
  [[nodiscard]] std::size_t bytes() const;
};

}  // namespace kerf
