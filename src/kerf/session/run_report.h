// The report of a run, as JSON with versioned keys (docs/outputs.md).
#pragma once

#include <string>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/session/session.h"

namespace kerf {

/// What a run collects beside the session's own records.
struct RunLog {
  struct Step {
    double time = 0;       ///< s, simulated, at its end
    double seconds = 0;    ///< the whole step
    double mechanics = 0;  ///< s of it
    int iterations = 0;
    double residual = 0;   ///< relative
    bool cap_hit = false;
    bool stopped_by_floor = false;  ///< at rest: the residual is rounding
    int inverted = 0;
    double kinetic_energy = 0;  ///< J
  };
  std::vector<Step> steps;
  struct Check {
    double time = 0;
    std::string what;     ///< "start", "stroke 1", "end"
    std::string problem;  ///< empty: every invariant holds
  };
  std::vector<Check> checks;
  BodyCounts counts_before;
  double prepare_seconds = 0;  ///< loading, binding, hexahedra
};

/// JSON text of the report. Keys are stable within one "version".
std::string run_report_json(const Session& session, const RunLog& log);

/// Median and 99th percentile (nearest rank) of values; zeros when there are none.
struct Quantiles {
  double median = 0, p99 = 0, worst = 0;
};
Quantiles quantiles(std::vector<double> values);

}  // namespace kerf
