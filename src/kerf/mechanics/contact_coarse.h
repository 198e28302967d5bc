// Contacts and tools in the coarse matrix of the solver. A contact ties groups of nodes that no element connects, and tools
// are six more unknowns: the coarse matrix gets blocks that the body alone has not. They are added to the structure when
// they are first needed, behind an elimination order that stays: a block that is zero changes no bit of the result, so it
// does not matter which were added before.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "kerf/mechanics/block_cholesky.h"

namespace kerf {

class MechanicsModel;
struct StepWorkspace;

struct ContactCoarse {
  /// A row on the rigid motion of one group or tool: u = weight t + w x arm.
  struct Part {
    std::int32_t place = 0;
    double weight = 0, arm[3] = {};
  };
  BlockCholeskyStructure cholesky;                                // the extended one
  std::vector<std::int32_t> base_order, base_rows, base_columns;  // of the structure that it extends
  std::vector<std::int32_t> stored;                               // block of the base -> block of the extended one
  std::vector<std::pair<std::int32_t, std::int32_t>> extra;       // places p > q, sorted
  std::vector<std::pair<std::int32_t, std::int32_t>> missing;
  std::vector<Part> parts;
  std::vector<std::int32_t> part_begin;  // per pressing row
};

/// The structure that the coarse matrix of this step is stored in.
const BlockCholeskyStructure& coarse_cholesky(const MechanicsModel& model, const StepWorkspace& workspace);

/// coarse.factored = coarse.blocks + J' P J of the pressing rows + the tools, not yet factored.
void add_contacts_to_coarse(const MechanicsModel& model, StepWorkspace& workspace);

}  // namespace kerf
