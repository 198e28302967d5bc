// Pre-processing (4.1) stage by stage: the paper's four sheets (422 s for the largest there) with local and exact paths, and
// closed sheets up to 10 million triangles. Every stage is a counter in milliseconds.
#include <benchmark/benchmark.h>

#include "kerf/base/parallel.h"
#include "kerf/binding/bind.h"
#include "kerf/mesh/models.h"

namespace {

using namespace kerf;

void bind_model(benchmark::State& state, const char* name, bool exact) {
  ModelOptions options;
  options.visual_triangles = static_cast<std::size_t>(state.range(0));
  const auto model = make_model(name, options);
  if (!model) return state.SkipWithError(model.error().message.c_str());
  const ThreadLimit one(1);
  BindReport::Seconds sum;
  std::int64_t vertices = 0;
  for (auto _ : state) {
    BindOptions how;
    how.exact = exact;
    how.thickness = 0.1;
    const auto body = bind(model->visual, model->collision, how);
    if (!body) return state.SkipWithError(body.error().message.c_str());
    const auto& s = body->report.seconds;
    sum.prepare += s.prepare, sum.vertices += s.vertices, sum.paths += s.paths, sum.patches += s.patches;
    sum.parameters += s.parameters, sum.assemble += s.assemble;
    vertices = body->report.input_vertices;
  }
  const auto per_run = [&](double seconds) { return benchmark::Counter(1e3 * seconds, benchmark::Counter::kAvgIterations); };
  state.counters["V"] = static_cast<double>(vertices);
  state.counters["prepare_ms"] = per_run(sum.prepare);
  state.counters["vertices_ms"] = per_run(sum.vertices);
  state.counters["paths_ms"] = per_run(sum.paths);
  state.counters["patches_ms"] = per_run(sum.patches);
  state.counters["parameters_ms"] = per_run(sum.parameters);
  state.counters["assemble_ms"] = per_run(sum.assemble);
}

BENCHMARK_CAPTURE(bind_model, sheet_local, "sheet", false)->Arg(1664)->Arg(6656)->Arg(26624)->Arg(106496)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(bind_model, sheet_exact, "sheet", true)->Arg(1664)->Arg(6656)->Arg(26624)->Arg(106496)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(bind_model, closed_sheet_local, "closed-sheet", false)->Arg(106000)->Arg(1000000)->Arg(10000000)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(bind_model, closed_sheet_exact, "closed-sheet", true)->Arg(106000)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
