// The benchmarks behind `kerf bench`.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "bench/bench_table.h"
#include "kerf/base/progress.h"

namespace kerf::bench {

struct BenchOptions {
  int cuts = 100;                          ///< of every kind; the paper's tables
  bool quick = false;                      ///< small sizes and few cuts: does it still run?
  std::string rows;                        ///< only tables whose id contains this; empty: all
  std::function<Status(const Run&)> kept;  ///< hears after each table what is there so far; its error ends the run

  [[nodiscard]] bool wants(std::string_view table) const {
    return rows.empty() || table.find(rows) != std::string_view::npos;
  }
  /// Of every kind, in this run.
  [[nodiscard]] int cut_count() const { return quick ? 3 : cuts; }
};

/// Tables 1 to 6, figures 16 and 17 and the figures of 5.3, beside the paper's values.
Result<Run> bench_paper(const BenchOptions& options, const Progress& progress);
/// How cost grows with the size of each mesh, with the number of cuts, and with threads; what many random strokes break.
Result<Run> bench_scale(const BenchOptions& options, const Progress& progress);

}  // namespace kerf::bench
