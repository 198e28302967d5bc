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
    double residual = 0;  ///< relative
    bool cap_hit = false;
    bool factorised = false;        ///< solved directly
    bool stopped_by_floor = false;  ///< at rest: the residual is rounding
    int inverted = 0;
    double kinetic_energy = 0;  ///< J
    int contacts = 0, pressing = 0;
    double overlap = 0;  ///< m: the deepest
    int slowed = 0;      ///< nodes whose speed was capped
  };
  std::vector<Step> steps;
  struct Tool {
    double force = 0, force_at = 0;    ///< N, the largest of ToolState::force; s
    double torque = 0, torque_at = 0;  ///< N m; s
  };
  std::vector<Tool> tools;  ///< of the scene
  struct Check {
    double time = 0;
    std::string what;     ///< "start", "stroke 1", "end"
    std::string problem;  ///< empty: every invariant holds
  };
  std::vector<Check> checks;
  BodyCounts counts_before;
  double prepare_seconds = 0;  ///< loading, binding, hexahedra

  /// A step that the session has just taken.
  void add(const Session& session, const SessionStep& step);
};

/// How far things were in each other.
struct DeepestOverlap {
  double metres = 0, share = 0;  ///< share: of the body's largest half thickness
  double time = 0;               ///< s
};
/// In any step.
DeepestOverlap deepest_overlap(const Session& session, const RunLog& log);
/// A sentence about things that got too deep into each other after the first step, or nothing.
std::string overlap_note(const Session& session, const RunLog& log);

/// Where a run is. A report that says kRunning is of a run that is under way, or that a signal or a crash ended.
struct RunState {
  enum class Status { kRunning, kComplete, kFailed };
  Status status = Status::kComplete;
  std::string reason;              ///< why it failed
  std::vector<std::string> files;  ///< names of the results, as result_files of run_outputs.h says
};

/// JSON text of the report. Keys are stable within one "version".
std::string run_report_json(const Session& session, const RunLog& log, const RunState& state = {});

/// The first keys of run_report_json, up to "notes". They need little memory, however large the body and however long the run.
std::string short_report_json(const Session& session, const RunState& state);

/// The same of a run whose bodies could not be made.
std::string short_report_json(const Scene& scene, const RunState& state);

/// Median and 99th percentile (nearest rank) of values; zeros when there are none.
struct Quantiles {
  double median = 0, p99 = 0, worst = 0;
};
Quantiles quantiles(std::vector<double> values);

}  // namespace kerf
