// Cuts across sheets on 104 collision triangles, open and closed, in the rest configuration: collision mesh, visual mesh
// and walls, without cells and embeddings. One thread, thread time; memory touched beforehand.
// Prints microseconds per collision triangle of a whole cut across in one move (median, 99th percentile), per cut (median), per undo, and per pose of
// a blade that moves on inside one face.
#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "kerf/base/random.h"
#include "kerf/binding/bind.h"
#include "kerf/cutting/blade_sweep.h"
#include "kerf/cutting/cut_memory.h"
#include "kerf/cutting/topology_change.h"
#include "kerf/mesh/models.h"

namespace {

using namespace kerf;

double now() {  // microseconds of this thread
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e6 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_nsec);
}

double percentile(std::vector<double> v, double p) {
  if (v.empty()) return 0;
  std::sort(v.begin(), v.end());
  return v[static_cast<std::size_t>(p * static_cast<double>(v.size() - 1))];
}

/// A body at rest and a blade that stands upright on its sheet.
struct Bench {
  CellComplex body;
  std::vector<Vec3> position{};
  FaceBoxes boxes{};
  CutOptions options{};
  CutScratch scratch{};
  JournalMark clean{};
  Box3 box{};

  explicit Bench(CellComplex complex) : body(std::move(complex)) {
    reserve_cut_memory(body, 60000);
    position = body.collision.rest.raw();
    for (const Vec3& p : position) box.add(p);
    journal_mark(body, clean);
  }
  [[nodiscard]] Vec3 at(double x, double y) const {
    return {box.min.x + x * box.size().x, box.min.y + y * box.size().y, 0};
  }
  [[nodiscard]] BladeEdge edge(Vec3 p) const {
    const Vec3 up{0, 0, body.mean_root_edge};
    return {p + up, p - up};
  }
  SweepTarget target() { return {body, position, boxes, scratch, options}; }
  void roll_back(const JournalMark& mark) {
    journal_rollback(body, mark);
    position.resize(body.collision.vertex_count());
    boxes.forget();
  }
};

void measure(const std::string& name, CellComplex body) {
  Bench bench(std::move(body));
  TopologyChange change;
  Random random(7);
  std::vector<double> step, whole, undo, pose, collect;
  int steps = 0;
  constexpr int kWarm = 2;  // cuts that are made and not counted
  for (int i = 0; i < 20 + kWarm; ++i) {
    const double a = random.uniform(0.05, 0.95), b = random.uniform(0.05, 0.95);
    const Vec3 from = i % 2 ? bench.at(-0.1, a) : bench.at(a, -0.1), to = i % 2 ? bench.at(1.1, b) : bench.at(b, 1.1);
    SweepTarget target = bench.target();
    BladeStroke stroke;
    lead_blade(stroke, bench.edge(from), target);
    double t0 = now();
    SweepReport report = lead_blade(stroke, bench.edge(to), target);
    report += make_ends(stroke, target);
    const double cut_time = now() - t0;
    if (report.refused || !report.steps) {
      fmt::print("{}: refused\n", name);
      return;
    }
    t0 = now();
    collect_topology_change(bench.body, bench.clean, bench.scratch, change);
    const double collect_time = now() - t0;
    t0 = now();
    bench.roll_back(bench.clean);
    const double undo_time = now() - t0;
    if (i < kWarm) continue;
    steps += report.steps;
    step.push_back(cut_time / report.steps);
    whole.push_back(cut_time);
    undo.push_back(undo_time);
    collect.push_back(collect_time);
  }
  // A blade that moves on inside: its end is taken back and made again every pose.
  for (int i = 0; i < 20; ++i) {
    const Vec3 p = bench.at(random.uniform(0.2, 0.8), random.uniform(0.2, 0.8));
    SweepTarget target = bench.target();
    BladeStroke stroke;
    lead_blade(stroke, bench.edge(p), target);
    for (int k = 1; k <= 5; ++k) {
      const double t0 = now();
      if (stroke.provisional) {
        bench.roll_back(stroke.mark);
        stroke.provisional = false;
      }
      lead_blade(stroke, bench.edge(p + Vec3{0.012 * k, 0.007 * k, 0}), target);
      journal_mark(bench.body, stroke.mark);
      make_ends(stroke, target);
      pose.push_back(now() - t0);
    }
    bench.roll_back(bench.clean);
  }
  fmt::print("{:<16}{:>9.1f}{:>9.1f}{:>12.3f}{:>10.1f}{:>10.1f}{:>10.1f}{:>10.1f}{:>8}\n", name, percentile(step, 0.5),
             percentile(step, 0.99), 1e-3 * percentile(whole, 0.5), percentile(collect, 0.5), percentile(undo, 0.5),
             percentile(pose, 0.5), percentile(pose, 0.99), steps);
}

}  // namespace

int main() {
  fmt::print("{:<16}{:>9}{:>9}{:>12}{:>10}{:>10}{:>10}{:>10}{:>8}\n", "", "tri p50", "tri p99", "cut p50 ms",
             "change us", "undo us", "pose p50", "pose p99", "steps");
  for (const bool closed : {false, true})
    for (const std::size_t triangles : {1664u, 6656u, 26624u, 106496u}) {
      ModelOptions options;
      options.visual_triangles = triangles;
      auto model = make_model(closed ? "closed-sheet" : "sheet", options);
      if (!model) {
        fmt::print("{}\n", model.error().message);
        continue;
      }
      BindOptions bind_options;
      if (!closed) bind_options.thickness = 0.1;
      auto body = bind(model->visual, model->collision, bind_options);
      if (!body) {
        fmt::print("{}\n", body.error().message);
        continue;
      }
      const std::string name = fmt::format("{} {}", closed ? "closed" : "sheet", body->complex.visual.vertex_count());
      measure(name, std::move(body->complex));
    }
}
