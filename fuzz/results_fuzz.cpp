// libFuzzer: results of benchmarks from anywhere are read or refused, and make a page.
#include <cstdlib>

#include "bench/bench_table.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto run = kerf::bench::parse_run({reinterpret_cast<const char*>(data), size}, "fuzz");
  if (!run) return 0;
  if (kerf::bench::results_page({*run}, "plots").empty()) std::abort();
  for (const auto& table : run->tables) (void)kerf::bench::csv(table);
  const std::string text = kerf::bench::run_json(*run);
  const auto again = kerf::bench::parse_run(text, "fuzz");
  if (!again || kerf::bench::run_json(*again) != text) std::abort();
  return 0;
}
