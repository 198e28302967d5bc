#include "kerf/scene/time_step_fault.h"

#include <fmt/format.h>

#include "kerf/scene/scene_limits.h"

namespace kerf {

std::string time_step_fault(const SceneSimulation& simulation) {
  const double step = simulation.time_step;
  if (step > kLongestTimeStep)
    return fmt::format("time_step of [simulation] goes up to {:g} s, but is {:g} s", kLongestTimeStep, step);
  if (step > simulation.duration && simulation.duration > 0)
    return fmt::format("time_step of [simulation] ({} s) is longer than its duration ({} s)", step,
                       simulation.duration);
  return {};
}

}  // namespace kerf
