// Clocks and percentiles of the benchmarks.
#pragma once

#include <string>
#include <vector>

#include "bench/bench_table.h"

namespace kerf::bench {

/// Seconds that this thread has computed: what other programs do on the machine is left out, what other threads of this one do too.
double thread_seconds();
/// Seconds on the clock on the wall.
double wall_seconds();

struct Sample {
  std::vector<double> values;
  void add(double value) { values.push_back(value); }
  /// Nearest rank, 0 < p <= 1; 0 without values.
  [[nodiscard]] double quantile(double p) const;
  [[nodiscard]] double median() const { return quantile(0.5); }
};

/// Median, 99th percentile and worst, times `unit`.
void append_quantiles(std::vector<Cell>& row, const Sample& sample, double unit);

}  // namespace kerf::bench
