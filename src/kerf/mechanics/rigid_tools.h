// Rigid tools in the time step: six unknowns each, (v, w), tied to a given pose by a virtual coupling that is as implicit as
// the rest, so that any stiffness is stable. Too fast or too strong a coupling is slowed down or weakened for the step.
#pragma once

#include "kerf/base/result.h"
#include "kerf/mechanics/block_cholesky.h"
#include "kerf/mechanics/contact_rows.h"

namespace kerf {

/// One tool in one step. Vectors are (move, turn).
struct ToolWork {
  double mass = 0, inertia = 0;  ///< effective: m + h (damping + drag) + h^2 stiffness, kg; the same for turns, kg m^2
  double length = 1;             ///< m; makes turns comparable with moves
  double stiffness = 0, damping = 0, turning_stiffness = 0, turning_damping = 0;  ///< after the limits
  Vec3 velocity, spin;                                                            ///< at the start: m/s, rad/s
  Vec3 offset, turn_offset;  ///< from tool to target at the start: m, rotation vector
  double right[6] = {}, solution[6] = {}, residual[6] = {}, search[6] = {}, product[6] = {}, preconditioned[6] = {};
  double start_solution[6] = {}, start_residual[6] = {};  ///< as the present pass began (pass_length.h)
  double block[kBlockDoubles] = {};                       ///< factored 6 x 6 diagonal block, contacts included
  bool touched = false;                                   ///< something presses on it in this pass
  double contact[6] = {};                                 ///< impulse of the contacts on it, N s, N m s
};

Status check_tool(const RigidTool& tool, const RigidState& state, std::size_t index);
void prepare_tool(const RigidTool& tool, const RigidState& state, double h, ToolWork& work);
/// The tool where the step's solution takes it.
RigidState moved_tool(const RigidState& state, const ToolWork& work, double h);
/// Forces and torques on the tool in the step: of the coupling, and of all else. Together they are what has moved it.
void forces_on_tool(const RigidTool& tool, const ToolWork& work, double h, RigidToolResult& result);

}  // namespace kerf
