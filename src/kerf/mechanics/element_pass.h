// The loops over batches of four elements that a time step makes. Each writes one value per (element, corner) into a slot of its own, and the nodes gather
// their slots afterwards, in fixed order. Products of full cells are added to the nodes' sums chunk by chunk instead. There are no atomics, and the bits are
// the same on any number of threads.
#pragma once

#include <cstddef>

#include "kerf/base/lanes.h"
#include "kerf/mechanics/mechanics_model.h"
#include "kerf/mechanics/step.h"

namespace kerf {

/// Elements per parallel chunk / 4; nodes per chunk. Fixed, because sums are taken per chunk.
inline constexpr std::size_t kBatchGrain = 32, kNodeGrain = 512;

/// Follows the rotations (workspace.rotation) to workspace.position and writes the elastic forces into the
/// slots, and into workspace.tension what of the stress resists turns. Returns the number of inverted elements.
int element_force_pass(const MechanicsModel& model, StepWorkspace& workspace, std::size_t begin, std::size_t end);

/// workspace.scaled_rotation and tension for a step of dt. weight: there is gravity; without it tension doesn't last in pieces that nothing holds, and they
/// have none in the matrix: it would brake their spin.
void element_scale_pass(const MechanicsModel& model, StepWorkspace& workspace, double dt, bool weight,
                        std::size_t begin, std::size_t end);

/// slot = (dt^2 + dt b) R K R' p for one search direction, with the springs of CellSprings in K. Batches of partly filled cells alone.
void element_stiffness_pass(const MechanicsModel& model, StepWorkspace& workspace,
                            const std::vector<StepWorkspace::Quad>& p, std::size_t begin, std::size_t end);

/// The same of batches of full cells, into the model's sums (MechanicsModel::Structure::sum_of), which are in workspace.product. Whole chunks of
/// sum_grain batches.
void element_sum_pass(const MechanicsModel& model, StepWorkspace& workspace, const std::vector<StepWorkspace::Quad>& p,
                      std::size_t begin, std::size_t end);

/// What these two passes, and those over springs and bonds, have left at a node.
inline Lanes product_of_elements(const MechanicsModel::Structure& s, const StepWorkspace& w, std::size_t node) {
  Lanes sum = s.summed[node] != 0 ? load_lanes(w.product[node].v) : all_lanes(0);
  for (std::int32_t i = s.more_begin[node]; i < s.more_begin[node + 1]; ++i) {
    const auto k = static_cast<std::size_t>(s.more[i]);
    sum += load_lanes(k < s.sums ? w.product[k].v : w.slot[k - s.sums].v);
  }
  return sum;
}

/// 3 x 3 diagonal blocks of the scaled stiffness, springs of CellSprings included, into diagonal_slot. Full cells write corners 0 to 3 only:
/// corner 7 - c has the block of corner c.
void element_diagonal_pass(const MechanicsModel& model, StepWorkspace& workspace, std::size_t begin, std::size_t end);

/// Slot that holds the diagonal block of a slot.
inline std::size_t diagonal_slot(std::size_t slot, std::size_t full_slots) {
  if (slot >= full_slots) return slot;
  const std::size_t corner = slot & 7;
  return corner < 4 ? slot : slot - corner + (7 - corner);
}

}  // namespace kerf
