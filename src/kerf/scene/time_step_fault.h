// How long a time step may be: in scene files, and where another one stands instead of theirs.
#pragma once

#include <string>

#include "kerf/scene/scene.h"

namespace kerf {

/// Why a scene can't have this time step; empty: it can.
std::string time_step_fault(const SceneSimulation& simulation);

}  // namespace kerf
