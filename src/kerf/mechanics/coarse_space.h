// The coarse half of the two-level preconditioner, z = D^-1 r + P C^-1 P' r: each group of nodes moves as a
// rigid body at its current position, C = P' A P is made and factored every step. Only ever added to the
// block-Jacobi part: damped Jacobi is no contraction for these elements, so a multiplicative combination is
// not positive definite.
#pragma once

#include <vector>

#include "kerf/mechanics/contact_coarse.h"
#include "kerf/mechanics/mechanics_model.h"

namespace kerf {

struct StepWorkspace;

/// Numbers of one step; vectors are by place in the elimination order (block_cholesky.h).
struct CoarseSpace {
  std::vector<double> centre;      ///< 3 per group, m
  std::vector<double> blocks;      ///< the coarse matrix without contacts
  std::vector<double> factored;    ///< factor of the coarse matrix, contacts and tools included
  std::vector<double> value;       ///< 8 per group, then per tool: (t, w, 0, 0), the solution
  std::vector<double> restricted;  ///< the same of P' residual
  ContactCoarse contact;
};

/// Arms of the nodes and coarse matrix for a prepared step (positions, scaled rotations, masses, springs), without contacts. From the node matrix
/// where that has been put together, else from the crossings.
void prepare_coarse_space(const MechanicsModel& model, StepWorkspace& workspace, double dt);

/// Adds the contacts of this pass, if any, and factors.
void factor_coarse_space(const MechanicsModel& model, StepWorkspace& workspace);

/// value = C^-1 P' residual; returns residual' P value.
double solve_coarse(const MechanicsModel& model, StepWorkspace& workspace, bool parallel);

}  // namespace kerf
