// Automatic collision meshes: a closed surface in, a bound body out. Names say how many triangles go in.
#include <benchmark/benchmark.h>

#include <cmath>
#include <filesystem>

#include "kerf/mesh/mesh_file.h"
#include "kerf/mesh/models.h"
#include "kerf/mesh/surface_check.h"
#include "kerf/scene/automatic_body.h"

namespace {

using namespace kerf;

/// A bent closed sheet of about n triangles with waves and, if asked, noise.
TriangleMesh scan(std::size_t n, double noise) {
  ModelOptions options;
  options.visual_triangles = n;
  options.rim_radius = 0.02;
  options.bend = 1.2;
  options.bumps = 0.02;
  options.noise = noise;
  auto model = make_model("closed-sheet", options);
  return model.ok() ? std::move(model->visual) : TriangleMesh{};
}

void run(benchmark::State& state, const TriangleMesh& input) {
  if (input.triangles.empty()) return state.SkipWithError("the mesh is not here");
  AutomaticBody body;
  for (auto _ : state) {
    TriangleMesh mesh = input;
    const auto checked = check_surface(mesh);
    if (!checked.ok()) return state.SkipWithError(checked.error().message.c_str());
    auto made = make_automatic_body(mesh, 0, {});
    if (!made.ok()) return state.SkipWithError(made.error().message.c_str());
    if (!made->bound)
      return state.SkipWithError((made->refused ? made->refused->message : not_thin_message(made->midsurface)).c_str());
    body = std::move(*made);
  }
  const MidsurfaceSeconds& s = body.midsurface.seconds;
  state.counters["triangles_in"] = static_cast<double>(input.triangles.size());
  state.counters["triangles_out"] = static_cast<double>(body.midsurface.collision.triangles.size());
  for (const auto& [name, value] : {std::pair{"prepare_ms", s.prepare},
                                    {"working_ms", s.working},
                                    {"pairs_ms", s.pairs},
                                    {"labels_ms", s.labels},
                                    {"sheet_ms", s.sheet},
                                    {"remesh_ms", s.remesh},
                                    {"relax_ms", s.relax},
                                    {"quality_ms", s.quality},
                                    {"midsurface_ms", s.total},
                                    {"bind_ms", body.bound->report.seconds.total}})
    state.counters[name] = 1e3 * value;
}

void BM_MedialMeniscus(benchmark::State& state) {
  // Real anatomy that may lie beside the project; see README.
  const std::filesystem::path path = "../shared/meshes/medial-meniscus.obj";
  TriangleMesh mesh;
  for (const auto& base : {std::filesystem::path("."), std::filesystem::path(".."), std::filesystem::path("../..")})
    if (std::filesystem::exists(base / path))
      if (auto read = read_mesh((base / path).string()); read.ok()) mesh = std::move(*read);
  run(state, mesh);
}
BENCHMARK(BM_MedialMeniscus)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();

void BM_Meniscus(benchmark::State& state) {
  auto model = make_model("meniscus", {});
  run(state, model.ok() ? model->visual : TriangleMesh{});
}
BENCHMARK(BM_Meniscus)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();

void BM_Scan(benchmark::State& state) { run(state, scan(static_cast<std::size_t>(state.range(0)), 0)); }
BENCHMARK(BM_Scan)
    ->Arg(3000)
    ->Arg(120000)
    ->Arg(1200000)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

void BM_NoisyScan(benchmark::State& state) {
  const auto n = static_cast<std::size_t>(state.range(0));
  run(state, scan(n, 0.4 / std::sqrt(static_cast<double>(n))));  // a third of an edge
}
BENCHMARK(BM_NoisyScan)
    ->Arg(120000)
    ->Arg(1200000)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

}  // namespace

BENCHMARK_MAIN();
