// A cut moves material from node to node, and twins that come together had velocities of their own. Momentum must not change by that, and
// kinetic energy must not grow (invariant 9).
#pragma once

#include <vector>

#include "kerf/lattice/hex_mesh.h"
#include "kerf/mechanics/mechanics_model.h"
#include "kerf/mechanics/step.h"
#include "kerf/session/node_fade.h"

namespace kerf {

/// What a pose of the blade has changed so far, kg m/s and J, and the nodes that it has changed.
struct CutBalance {
  Vec3 momentum;
  double kinetic = 0;
  std::vector<NodeId> nodes;
  std::vector<double> masses;  ///< memory
  void clear();
};

/// Before an element is changed: its share goes. After: it comes back.
void leave_balance(const MechanicsModel& model, const MechanicsState& state, HexId id, CutBalance& balance);
void join_balance(const MechanicsModel& model, const MechanicsState& state, HexId id, CutBalance& balance);
/// For nodes that have been given another motion: the share of those elements around them that are not in `changed` (ascending).
void move_in_balance(const HexMesh& hex, const MechanicsModel& model, const MechanicsState& state,
                     std::span<const NodeMotion> old, std::span<const HexId> changed, CutBalance& balance);

/// Is there anything to put right? Makes the list of nodes ready: those that move, ascending, each once.
bool out_of_balance(const HexMesh& hex, const MechanicsModel& model, const MechanicsState& state, CutBalance& balance);

/// Shifts the velocities of the changed nodes so that momentum is what it was, and draws them together towards their mean until kinetic
/// energy is not more than it was. What is shown keeps its velocity.
void settle_balance(CutBalance& balance, MechanicsState& state, NodeFade& fade);

}  // namespace kerf
