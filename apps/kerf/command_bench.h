// kerf bench: the paper's tables measured again, how cost grows, and the page of results.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace kerf::app {

struct BenchCommand {
  std::string what;           ///< "paper" or "scale"
  std::filesystem::path out;  ///< folder for JSON, CSV and SVG; empty: only print
  int cuts = 100;
  bool quick = false;
  std::string rows;
  bool quiet = false;
};
int run_bench(const BenchCommand& options);

struct BenchPage {
  std::vector<std::string> files;    ///< JSON of benchmarks
  std::filesystem::path out;         ///< the page
  std::string pictures = "results";  ///< folder of the plots, relative to the page
};
int write_bench_page(const BenchPage& options);

}  // namespace kerf::app
