// How cost grows: one quantity at a time, on closed sheets of 1 x 1 x 0.1 m; and how well many random strokes end.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "bench/bench_bodies.h"
#include "bench/benchmarks.h"
#include "bench/machine.h"
#include "bench/random_strokes.h"
#include "bench/session_timing.h"
#include "kerf/base/parallel.h"
#include "kerf/base/random.h"

namespace kerf::bench {
namespace {

constexpr double kMilli = 1e3, kMicro = 1e6;

/// The number of collision triangles, of those that closed sheets offer, nearest to `wanted`.
std::size_t offered_collision(double wanted) {
  const auto n = static_cast<std::size_t>(std::max(4L, std::lround(std::sqrt(wanted / 2))));
  return 2 * n * n;
}

class ScaleBench {
 public:
  ScaleBench(const BenchOptions& options, const Progress& progress) : options_(options), progress_(progress) {}

  Result<Run> run() {
    {
      const ThreadLimit one(1);
      KERF_TRY(binding());
      KERF_TRY(visual("visual", "Visual mesh, collision mesh of 104 triangles", 0));
      KERF_TRY(visual("ratio", "Visual mesh, 100 visual triangles per collision triangle", 100));
      KERF_TRY(collision());
      KERF_TRY(hexahedra());
      KERF_TRY(number_of_cuts());
      if (wanted("random")) {
        auto table = random_strokes(options_, progress_);
        if (!table) return table.error();
        KERF_TRY(finish(std::move(*table)));
      }
    }
    KERF_TRY(threads());
    return std::move(run_);
  }

 private:
  bool wanted(std::string_view id) { return options_.wants(id) && progress_(id, 0).ok(); }
  Status finish(Table table) {
    run_.tables.push_back(std::move(table));
    run_.machine = machine_facts();
    return options_.kept ? options_.kept(run_) : Status{};
  }

  /// Sizes, pre-processing, cuts and frames of one body.
  Status body_row(Table& table, const BenchBody& body) {
    const double start = thread_seconds();
    auto session = bench_session(body);
    if (!session) return session.error();
    const double prepare = thread_seconds() - start;
    const BodyCounts c = session->counts();
    KERF_TRY(progress_(fmt::format("{}: {} visual, {} collision triangles, {} hexahedra", table.id, c.visual_triangles,
                                   c.collision_triangles, c.hexahedra),
                       0));
    const auto timings = time_cuts(*session, options_.cut_count());
    if (!timings) return timings.error();
    const auto poses = time_poses(*session, std::max(1, options_.cut_count() / 20));
    if (!poses) return poses.error();
    const auto dust = time_dust(*session, std::max(1, options_.cut_count() / 20));
    if (!dust) return dust.error();
    KERF_TRY(session->step(5));  // it begins to sag
    const auto moving = time_poses(*session, std::max(1, options_.cut_count() / 20), true);
    if (!moving) return moving.error();
    const auto frames = time_frames(*session, options_.quick ? 5 : c.visual_triangles > 500'000 ? 30 : 200);
    if (!frames) return frames.error();
    table.rows.push_back({static_cast<double>(c.visual_triangles), static_cast<double>(c.collision_triangles),
                          static_cast<double>(c.hexahedra), prepare, timings->triangles,
                          kMicro * timings->per_triangle.median(), kMicro * timings->per_triangle.quantile(0.99),
                          kMilli * timings->whole.median(), kMilli * timings->whole.quantile(0.99),
                          kMilli * poses->median(), kMilli * poses->quantile(0.99),
                          kMilli * timings->begin_and_end.median(), kMilli * timings->undo.median(),
                          kMilli * frames->mechanics.median(), kMilli * frames->surface.median(),
                          kMilli * moving->median(), kMilli * moving->quantile(0.99), kMilli * dust->median()});
    return {};
  }
  static Table body_table(const char* id, const char* title) {
    Table table;
    table.id = id;
    table.title = title;
    table.columns = {"visual triangles",
                     "collision triangles",
                     "hexahedra",
                     "from the model to the first step (s)",
                     "triangles in a cut",
                     "cut per triangle, median (us)",
                     "99th percentile (us)",
                     "whole cut, median (ms)",
                     "99th percentile (ms)",
                     "pose by hand, median (ms)",
                     "99th percentile (ms)",
                     "begin and end a stroke (ms)",
                     "undo (ms)",
                     "mechanics (ms)",
                     "surface (ms)",
                     "pose by hand while it moves, median (ms)",
                     "99th percentile (ms)",
                     "sweep up dust at the end of a stroke (ms)"};
    return table;
  }
  void add_plot(const Table& table, const char* id, std::size_t x, const std::vector<std::size_t>& columns,
                const char* y) {
    Figure figure;
    figure.id = id;
    figure.caption = table.title;
    figure.plot.title = table.title;
    figure.plot.x_label = table.columns[x];
    figure.plot.y_label = y;
    figure.plot.log_x = figure.plot.log_y = true;
    for (const std::size_t c : columns) {
      app::PlotLine line{table.columns[c], {}, true, ""};
      for (const auto& row : table.rows) line.points.push_back({row[x].number, row[c].number});
      figure.plot.lines.push_back(std::move(line));
    }
    run_.figures.push_back(std::move(figure));
  }

  /// Pre-processing, stage by stage.
  Status binding() {
    if (!wanted("binding")) return {};
    Table table;
    table.id = "binding";
    table.title = "Pre-processing by stage, 104 collision triangles";
    table.note =
        "Seconds; the total is the thread's time, stages are those of the clock on the wall. Memory: the largest of the process so far.";
    table.columns = {"body",        "paths",          "visual vertices",   "total",
                     "weld, check", "bound vertices", "paths, re-meshing", "patches",
                     "parameters",  "assemble",       "memory (MB)"};
    struct Row {
      const char* model;
      std::size_t visual;
      bool exact;
    };
    for (const Row& row : {Row{"sheet", 1664, false},
                           {"sheet", 6656, false},
                           {"sheet", 26624, false},
                           {"sheet", 106496, false},
                           {"sheet", 106496, true},
                           {"closed-sheet", 106000, false},
                           {"closed-sheet", 106000, true},
                           {"closed-sheet", 1'000'000, false},
                           {"closed-sheet", 5'000'000, false},
                           {"closed-sheet", 10'000'000, false}}) {
      if (options_.quick && row.visual > 30'000) continue;
      const auto timing = time_binding({row.model, row.visual, 104}, options_.quick || row.visual > 500'000 ? 1 : 5,
                                       row.exact, !row.exact);
      if (!timing) return timing.error();
      const BindReport::Seconds& s = timing->report.seconds;
      table.rows.push_back({row.model, row.exact ? "exact" : "local",
                            static_cast<double>(timing->report.input_vertices),
                            row.exact ? timing->exact : timing->local, s.prepare, s.vertices, s.paths, s.patches,
                            s.parameters, s.assemble, std::round(peak_memory() / 1e6)});
    }
    return finish(std::move(table));
  }

  /// From a thousand to ten million visual triangles; collision mesh fixed (ratio 0) or growing with it.
  Status visual(const char* id, const char* title, double ratio) {
    if (!wanted(id)) return {};
    Table table = body_table(id, title);
    table.note = fmt::format("{} straight cuts across, each undone; frames of 10 ms; one thread, its own time.",
                             options_.cut_count());
    for (const double size : {1e3, 1e4, 1e5, 1e6, 1e7}) {
      if (options_.quick && size > 1e4) break;
      KERF_TRY(body_row(
          table, {"closed-sheet", static_cast<std::size_t>(size), ratio > 0 ? offered_collision(size / ratio) : 104}));
    }
    add_plot(table, fmt::format("{}-cut", id).c_str(), 0, {5, 6, 9}, "us per triangle, ms per pose");
    add_plot(table, fmt::format("{}-prepare", id).c_str(), 0, {3}, "s");
    return finish(std::move(table));
  }

  Status collision() {
    if (!wanted("collision")) return {};
    Table table = body_table("collision", "Collision mesh, 200,000 visual triangles");
    table.note = "As above. A cut across enters more triangles the finer they are.";
    for (const double size : {50.0, 200.0, 1250.0, 5000.0, 20000.0, 51200.0}) {
      if (options_.quick && size > 1000) break;
      KERF_TRY(body_row(table, {"closed-sheet", options_.quick ? 20000U : 200000U, offered_collision(size)}));
    }
    add_plot(table, "collision-cut", 1, {5, 6}, "us per triangle");
    return finish(std::move(table));
  }

  Status hexahedra() {
    if (!wanted("hexahedra")) return {};
    Table table = body_table("hexahedra", "Hexahedra, 100,000 visual on 1,250 collision triangles");
    table.note = "As above. Mechanics: one step of 10 ms.";
    for (const int n : {7, 14, 32, 71, 141, 224}) {
      if (options_.quick && n > 14) break;
      KERF_TRY(body_row(table, {"closed-sheet", options_.quick ? 20000U : 100000U, 1250, n}));
    }
    add_plot(table, "hexahedra-cut", 2, {5, 6}, "us per triangle");
    add_plot(table, "hexahedra-step", 2, {13}, "ms per step");
    return finish(std::move(table));
  }

  /// Ten thousand cuts in one body, none undone.
  Status number_of_cuts() {
    if (!wanted("cuts")) return {};
    Table table;
    table.id = "cuts";
    table.title = "Number of cuts in one body";
    table.columns = {"cuts so far",
                     "visual triangles",
                     "collision triangles",
                     "hexahedra",
                     "pieces",
                     "refused steps",
                     "triangles in a cut",
                     "cut per triangle, median (us)",
                     "99th percentile (us)",
                     "whole cut, median (ms)",
                     "99th percentile (ms)",
                     "begin and end a stroke (ms)",
                     "undo of the last (ms)",
                     "memory (MB)",
                     "invariants"};
    const std::size_t visual = options_.quick ? 50'000 : 500'000;
    auto session = bench_session({"closed-sheet", visual, offered_collision(options_.quick ? 2000 : 20'000), 40}, 0);
    if (!session) return session.error();
    const double length = 3 * session->body().complex.mean_root_edge;
    table.note = fmt::format(
        "Straight cuts of {:.0f} mm at random, from within to within, all of them staying, and the dust too. Times are of the cuts that a row adds. What "
        "other cuts have left is cut again. So pieces get smaller and more numerous, and a cut enters more triangles. Memory: the largest "
        "of the process so far.",
        1e3 * length);
    const int most = options_.quick ? 100 : 10'000;
    int so_far = 0, refused = 0;
    for (int next = 10; so_far < most; next = next < 1000 ? 10 * next : next + 1000) {
      next = std::min(next, most);
      const auto timings = time_short_cuts(*session, next - so_far, length, 1000 + static_cast<std::uint64_t>(so_far));
      if (!timings) return timings.error();
      so_far = next;
      refused += timings->refused;
      const double start = thread_seconds();
      KERF_TRY(session->undo());
      const double undone = thread_seconds() - start;
      KERF_TRY(session->redo());
      const BodyCounts c = session->counts();
      const Status valid = session->validate();
      KERF_TRY(progress_(fmt::format("cuts: {}", so_far), static_cast<double>(so_far) / most));
      table.rows.push_back({static_cast<double>(so_far), static_cast<double>(c.visual_triangles),
                            static_cast<double>(c.collision_triangles), static_cast<double>(c.hexahedra),
                            static_cast<double>(c.pieces), static_cast<double>(refused), timings->triangles,
                            kMicro * timings->per_triangle.median(), kMicro * timings->per_triangle.quantile(0.99),
                            kMilli * timings->whole.median(), kMilli * timings->whole.quantile(0.99),
                            kMilli * timings->begin_and_end.median(), kMilli * undone, std::round(peak_memory() / 1e6),
                            valid ? "hold" : valid.error().message});
    }
    add_plot(table, "cuts-time", 0, {7, 8}, "us per triangle");
    return finish(std::move(table));
  }

  /// One thread and two, on the clock on the wall; the state after the steps must be the same.
  Status threads() {
    if (!wanted("threads")) return {};
    Table table;
    table.id = "threads";
    table.title = "Threads";
    table.note =
        "Clock on the wall: other programs on the machine count too. The state after the steps has the same hash for both.";
    table.columns = {"threads", "", "size", "seconds", "hash"};
    const std::size_t visual = options_.quick ? 20'000 : 5'000'000;
    const int cells = options_.quick ? 20 : 70;
    for (const int count : {1, 2}) {
      const ThreadLimit limit(count);
      const auto timing = time_binding({"closed-sheet", 2 * visual, 104}, 1, false, true);
      if (!timing) return timing.error();
      const BindReport::Seconds& s = timing->report.seconds;
      table.rows.push_back({static_cast<double>(count), "pre-processing, everything but reading files",
                            fmt::format("{} visual vertices", timing->report.input_vertices),
                            s.prepare + s.vertices + s.paths + s.patches + s.parameters + s.assemble, ""});
    }
    for (const int count : {1, 2}) {
      const ThreadLimit limit(count);
      const double start = wall_seconds();
      auto large = bench_session({"closed-sheet", visual, offered_collision(options_.quick ? 200 : 20'000)});
      if (!large) return large.error();
      table.rows.push_back({static_cast<double>(count), "from the model to the first step",
                            fmt::format("{} visual triangles", large->counts().visual_triangles),
                            wall_seconds() - start, fmt::format("{:016x}", large->hash())});
    }
    for (const int count : {1, 2}) {
      const ThreadLimit limit(count);
      auto session = bench_session({"closed-sheet", 20'000, 500, cells});
      if (!session) return session.error();
      Sample steps;
      for (int i = 0; i < (options_.quick ? 5 : 100); ++i) {
        const double start = wall_seconds();
        KERF_TRY(session->step(1));
        steps.add(wall_seconds() - start);
      }
      table.rows.push_back({static_cast<double>(count), "a step of 10 ms, median",
                            fmt::format("{} nodes", session->counts().nodes), steps.median(),
                            fmt::format("{:016x}", session->hash())});
    }
    return finish(std::move(table));
  }

  const BenchOptions& options_;
  const Progress& progress_;
  Run run_;
};

}  // namespace

Result<Run> bench_scale(const BenchOptions& options, const Progress& progress) {
  return ScaleBench(options, progress).run();
}

}  // namespace kerf::bench
