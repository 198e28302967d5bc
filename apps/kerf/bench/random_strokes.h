// Many random strokes in many bodies: what breaks, and how exact the body stays.
#pragma once

#include "bench/bench_table.h"
#include "bench/benchmarks.h"
#include "kerf/base/progress.h"

namespace kerf::bench {

/// A row per closed model: strokes that cut, errors, broken invariants, open edges, error of the volume, undos that brought back something else,
/// times. What is drawn is measured here, with none of the library's own checks. An error of one stroke is counted, not returned.
Result<Table> random_strokes(const BenchOptions& options, const Progress& progress);

}  // namespace kerf::bench
