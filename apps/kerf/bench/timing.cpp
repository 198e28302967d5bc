#include "bench/timing.h"

#include <time.h>

#include <algorithm>
#include <cmath>

namespace kerf::bench {
namespace {

double seconds(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace

double thread_seconds() { return seconds(CLOCK_THREAD_CPUTIME_ID); }
double wall_seconds() { return seconds(CLOCK_MONOTONIC); }

double Sample::quantile(double p) const {
  if (values.empty()) return 0;
  std::vector<double> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  const auto rank = static_cast<std::size_t>(std::ceil(p * static_cast<double>(sorted.size())));
  return sorted[std::clamp<std::size_t>(rank, 1, sorted.size()) - 1];
}

void append_quantiles(std::vector<Cell>& row, const Sample& sample, double unit) {
  for (const double p : {0.5, 0.99, 1.0})
    row.push_back(sample.values.empty() ? Cell() : Cell(unit * sample.quantile(p)));
}

}  // namespace kerf::bench
