// Pieces of a body that nothing holds (a chip cut off in mid-air) and their rigid motion.
//
// A solve from zero that stops early leaves part of the momentum behind, as if the piece fell through syrup.
// So a free piece starts from the rigid motion that takes up its whole momentum, and gets what the solver
// left over at the end: linear momentum is exact whatever the tolerance, free fall costs no iteration.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kerf/base/ids.h"

namespace kerf {

class MechanicsModel;
struct StepWorkspace;

struct RigidPieces {
  std::int32_t pieces = 0;               ///< connected through elements, held ones included
  std::vector<std::int32_t> piece;       ///< per node; -1: unused
  std::vector<double> size;              ///< per piece: m, diagonal of its box at rest
  std::vector<std::int32_t> free;        ///< pieces without a held node and without a spring to a fixed place
  std::vector<std::int32_t> free_index;  ///< per piece: its place in `free`, or -1
  std::vector<std::int32_t> member_begin, members;  ///< per entry of `free`: its nodes
  /// Is the piece of these nodes free? Of a cell with little material some have no mass, and so no piece.
  [[nodiscard]] bool is_free(std::span<const NodeId> nodes) const;
};

/// Free pieces lighter than this part of a full cell, and this part of all: crumbs of slivers.
inline constexpr double kCrumb = 0.05, kCrumbShare = 0.01;

/// O(elements).
RigidPieces rigid_pieces(const MechanicsModel& model);

/// For every free piece: adds to workspace.solution the rigid motion about its centre that carries the
/// momentum workspace.residual, and takes its M v from the residual. Pieces that touch something are left out: what
/// they touch takes up momentum too.
void absorb_rigid_momentum(const MechanicsModel& model, StepWorkspace& workspace);

/// Crumbs weigh next to nothing for their stiffness; what is left undone there, or the torque that rounding makes out of large
/// forces, would set them spinning ever faster. They move as one, without turning, with the momentum that they have in
/// workspace.solution.
void carry_crumbs(const MechanicsModel& model, StepWorkspace& workspace);

}  // namespace kerf
