// A step can be wrong: rotations are frozen in it, and contacts are guessed as it begins. What it makes of that is speed, and more of it in each step,
// until points of the body are too far apart to be followed. So a piece may come apart no faster than parts of a step can follow.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kerf/mechanics/mechanics_model.h"
#include "kerf/mechanics/step.h"

namespace kerf {

struct SpeedLimits {
  double time = 0;     ///< s: of the longest part that a step is divided into where all of it is fast
  double reached = 0;  ///< m/s: what something had as the step began, or has that moves nodes
};

/// What was slowed down.
struct SlowedNodes {
  int count = 0;
  double fastest = 0;  ///< m/s, of them before
};

/// Memory, per piece.
struct SpeedCapWork {
  std::vector<Vec3> velocity, lost;
  std::vector<double> mass;
};

/// After a step of h seconds, whose free pieces that touched something are marked in `touched` (none: nothing did). Nodes that are faster than
/// `reached`, and than kMostWay of their piece's size in `time`, are slowed down to the greater of both; their positions go with them. In a piece
/// in flight speeds are those against its mean, and it keeps its momentum. No piece gains energy. Supports keep their velocity. O(nodes);
/// allocates nothing in steady state.
SlowedNodes cap_speeds(const MechanicsModel& model, const SpeedLimits& limits, std::span<const std::uint8_t> touched,
                       double h, MechanicsState& state, SpeedCapWork& work);

/// m/s: that of the fastest node that has mass, or is held.
double fastest_node(const MechanicsModel& model, const MechanicsState& state);

}  // namespace kerf
