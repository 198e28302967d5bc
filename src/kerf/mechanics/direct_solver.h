// The step's linear system by a sparse direct solver: the oracle that the iterative one is measured against.
#pragma once

#include "kerf/base/result.h"
#include "kerf/mechanics/mechanics_model.h"

namespace kerf {

struct StepWorkspace;

/// Solves A v = right_side for workspace.solution, whose entries at held nodes are given. Needs the scaled
/// rotations, masses and spring scales of a prepared step. Allocates; factors anew each time.
Status direct_solve(const MechanicsModel& model, StepWorkspace& workspace, double dt);

}  // namespace kerf
