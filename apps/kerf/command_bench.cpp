#include "command_bench.h"

#include <fmt/format.h>

#include "bench/benchmarks.h"
#include "command_files.h"
#include "exit_status.h"
#include "folder.h"
#include "kerf/base/shown_text.h"
#include "kerf/mesh/whole_file.h"
#include "plot.h"
#include "progress_bar.h"
#include "terminal.h"

namespace kerf::app {
namespace {

Status write_run(const bench::Run& run, const BenchCommand& options) {
  KERF_TRY(make_folder(options.out));
  for (const bench::Table& table : run.tables)
    KERF_TRY(replace_file((options.out / (table.id + ".csv")).string(), bench::csv(table)));
  for (const bench::Figure& figure : run.figures) KERF_TRY(write_svg(options.out / (figure.id + ".svg"), figure.plot));
  return replace_file((options.out / (options.what + ".json")).string(), bench::run_json(run));
}

}  // namespace

int run_bench(const BenchCommand& options) {
  bench::BenchOptions how;
  how.cuts = options.cuts;
  how.quick = options.quick;
  how.rows = options.rows;
  if (!options.out.empty()) {
    Status possible = make_folder(options.out);
    if (possible) possible = check_places({{"the measurements", options.out / (options.what + ".json")}});
    if (!possible) return report(possible.error());
  }
  std::string program = fmt::format("kerf bench {} ", options.what);
  program += options.quick ? std::string("--quick") : fmt::format("--cuts {}", options.cuts);
  if (!options.rows.empty()) program += fmt::format(" --rows {}", options.rows);
  if (!options.out.empty())
    how.kept = [&](const bench::Run& so_far) {
      bench::Run named = so_far;
      named.program = program;
      return write_run(named, options);
    };
  Result<bench::Run> run = [&] {
    ProgressBar bar(options.quiet);
    return options.what == "paper" ? bench::bench_paper(how, bar.callback()) : bench::bench_scale(how, bar.callback());
  }();
  if (!run) return report(run.error());
  if (run->tables.empty())
    return report(bad_input(
        fmt::format("no table of \"kerf bench {}\" has \"{}\" in its name", options.what, shown(options.rows))));
  run->program = program;
  if (!options.quiet)
    for (const bench::Table& table : run->tables)
      put(stdout, fmt::format("\n{}\n\n{}", table.title, bench::markdown(table)));
  if (options.out.empty()) return kSuccess;
  if (const Status written = write_run(*run, options); !written) return report(written.error());
  if (!options.quiet) say("\nresults: {}\n", options.out.string());
  return kSuccess;
}

int write_bench_page(const BenchPage& options) {
  std::vector<CommandFile> inputs;
  for (const std::string& file : options.files) inputs.push_back({"the measurements", file});
  const CommandFile page{"the page", options.out};
  if (const Status apart = check_outputs(inputs, {page}); !apart) return report(apart.error());
  if (const Status known = check_ending(page, {".md", ""}); !known) return report(known.error());
  std::vector<bench::Run> runs;
  for (const std::string& file : options.files) {
    const auto text = read_whole_file(file, kOtherFile);
    if (!text) return report(text.error());
    auto run = bench::parse_run(text->view(), file);
    if (!run) return report(run.error());
    runs.push_back(std::move(*run));
  }
  if (const Status written = replace_file(options.out.string(), bench::results_page(runs, options.pictures)); !written)
    return report(written.error());
  return kSuccess;
}

}  // namespace kerf::app
