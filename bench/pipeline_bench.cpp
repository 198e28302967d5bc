// The whole pipeline beside the paper's tables: binding, cuts with all updates, steps, surface. One thread, thread time.
//   pipeline_bench [cuts [text]]     cuts per body, 100 when not given; only rows with this text
#include <fmt/format.h>
#include <sys/resource.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "kerf/base/parallel.h"
#include "kerf/base/random.h"
#include "kerf/binding/bind.h"
#include "kerf/session/run_report.h"
#include "kerf/session/session.h"

namespace {

using namespace kerf;

double now() {  // seconds of this thread
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

std::string only;
bool wanted(const std::string& what) { return what.find(only) != std::string::npos; }

void row(const std::string& what, const std::string& paper, const std::string& reach, const std::string& here) {
  fmt::print("| {:<66} | {:>14} | {:>22} | {:>34} |\n", what, paper, reach, here);
  std::fflush(stdout);
}
std::string ms(const Quantiles& q) { return fmt::format("{:.3f} / {:.3f} ms", 1e3 * q.median, 1e3 * q.p99); }

void bench_binding() {
  if (!wanted("pre-processing")) return;
  ModelOptions options;
  options.visual_triangles = 106496;
  const auto model = make_model("sheet", options);
  for (const bool exact : {false, true}) {
    std::vector<double> times;
    for (int i = 0; i < 7; ++i) {
      BindOptions bind_options;
      bind_options.exact = exact;
      bind_options.thickness = 0.1;
      const double start = now();
      const auto bound = bind(model->visual, model->collision, bind_options);
      times.push_back(now() - start);
      if (!bound) std::abort();
    }
    row(fmt::format("pre-processing, 53,633-vertex sheet, {} paths", exact ? "exact" : "local"), "422 s",
        exact ? "0.6 s" : "0.12 s", fmt::format("{:.3f} s", quantiles(times).median));
  }
}

struct CutFigures {
  std::vector<double> whole, per_triangle, cut, surface, embedding;
};

/// Straight cuts from border to border of the uncut body, each undone afterwards. For a body in the plane.
CutFigures bench_cuts(Session& session, int cuts) {
  CutFigures figures;
  Random random(7);
  Box3 box;
  for (const Vec3 p : session.collision_positions()) box.add(p);
  const Vec3 c = box.center(), size = box.size();
  const double reach = norm(size);
  for (int i = 0; i < cuts; ++i) {
    const double angle = random.uniform(0, 6.283185307179586), shift = random.uniform(-0.25, 0.25);
    const Vec3 along{std::cos(angle), std::sin(angle), 0}, across{-along.y, along.x, 0};
    const Vec3 middle = c + shift * Vec3{across.x * size.x, across.y * size.y, 0};
    const Vec3 a = middle - reach * along, b = middle + reach * along, up{0, 0, reach};
    if (!session.begin_stroke(SceneFrame::kRest, false) || !session.move_blade(a + up, a - up)) std::abort();
    const double start = now();
    if (!session.move_blade(b + up, b - up)) std::abort();
    const double time = now() - start;
    if (!session.end_stroke()) std::abort();
    const StrokeRecord& record = session.strokes().back();
    if (record.triangles > 0) {
      figures.whole.push_back(time);
      figures.per_triangle.push_back(time / record.triangles);
      figures.cut.push_back(record.times.cut_and_binding / record.triangles);
      figures.surface.push_back(record.times.cut_surface / record.triangles);
      figures.embedding.push_back(record.times.embedding / record.triangles);
    }
    if (!session.undo()) std::abort();
  }
  return figures;
}

/// A cut drawn by hand: poses a fortieth of the body apart; the end inside a triangle is taken back and cut anew at each.
std::vector<double> bench_poses(Session& session, int cuts) {
  std::vector<double> times;
  Random random(11);
  Box3 box;
  for (const Vec3 p : session.collision_positions()) box.add(p);
  const Vec3 c = box.center(), size = box.size();
  const double reach = norm(size);
  for (int i = 0; i < cuts; ++i) {
    const double angle = random.uniform(0, 6.283185307179586);
    const Vec3 along{std::cos(angle), std::sin(angle), 0}, up{0, 0, reach};
    if (!session.begin_stroke(SceneFrame::kRest, false)) std::abort();
    for (int k = 0; k <= 50; ++k) {
      const Vec3 p = c + (-0.6 + 0.025 * k) * Vec3{along.x * size.x, along.y * size.y, 0};
      const double start = now();
      if (!session.move_blade(p + up, p - up)) std::abort();
      if (k > 0) times.push_back(now() - start);
    }
    if (!session.end_stroke() || !session.undo()) std::abort();
  }
  return times;
}

Session make_session(const std::string& model, std::size_t visual, std::size_t collision) {
  Scene scene;
  scene.name = scene.body.model = model;
  scene.body.options.visual_triangles = visual;
  scene.body.options.collision_triangles = collision;
  auto session = Session::create(scene);
  if (!session) {
    fmt::print("{}\n", session.error().message);
    std::abort();
  }
  return std::move(session).value();
}

void bench_cut_row(const std::string& what, const std::string& paper, const std::string& reach, const std::string& model,
                   std::size_t visual, std::size_t collision, int cuts) {
  if (!wanted(what)) return;
  Session session = make_session(model, visual, collision);
  const CutFigures f = bench_cuts(session, cuts);
  row(what + ": per collision triangle (cut / triangles)", "", reach, ms(quantiles(f.per_triangle)));
  row("    a whole cut across", paper, model == "sheet" && visual == 106496 ? "1.2 ms" : "", ms(quantiles(f.whole)));
  row("    of it: cut and binding / embedding / surface, us per triangle", "", "",
      fmt::format("{:.1f} / {:.1f} / {:.1f}", 1e6 * quantiles(f.cut).median, 1e6 * quantiles(f.embedding).median,
                  1e6 * quantiles(f.surface).median));
  row("    drawn by hand: per pose, end inside a triangle", "", "", ms(quantiles(bench_poses(session, std::max(1, cuts / 10)))));
}

void bench_step(const std::string& what, double dt, double young, const std::string& paper, const std::string& reach,
                std::array<int, 3> cells, const std::string& model) {
  if (!wanted(what)) return;
  Scene scene;
  scene.name = scene.body.model = model;
  scene.simulation.time_step = dt;
  scene.material.young = young;
  scene.material.poisson = 0.45;
  scene.material.density = 1000;
  scene.lattice.cells = cells;
  SceneFix fix;
  fix.region.shape = SceneRegion::Shape::kHalfSpace;
  fix.region.point = {-0.45, 0, 0};
  fix.region.normal = {-1, 0, 0};
  scene.fixes.push_back(fix);
  auto session = Session::create(scene);
  if (!session) return row(what, "", "", session.error().message.substr(0, 34));
  std::vector<double> times;
  for (int i = 0; i < 300; ++i) {
    const double start = now();
    if (!session->step()) std::abort();
    if (i >= 20) times.push_back(now() - start);
  }
  row(what, paper, reach, ms(quantiles(times)));
}

void bench_surface() {
  if (!wanted("positions and normals")) return;
  Session session = make_session("sheet", 106496, 104);
  std::vector<Vec3f> positions, normals;
  std::vector<double> times;
  for (int i = 0; i < 100; ++i) {
    const double start = now();
    session.visual_skin(positions, normals);
    if (i > 0) times.push_back(now() - start);
  }
  row("positions and normals of 53,633 visual vertices", "", "0.15 ms", ms(quantiles(times)));
}

}  // namespace

int main(int argc, char** argv) {
  const int cuts = argc > 1 ? std::max(1, std::atoi(argv[1])) : 100;
  if (argc > 2) only = argv[2];
  ThreadLimit one(1);
  fmt::print("| {:<66} | {:>14} | {:>22} | {:>34} |\n|{:-<68}|{:-<16}|{:-<24}|{:-<36}|\n", "one thread, release; median / 99th percentile",
             "paper", "to reach", "here", "", "", "", "");
  bench_binding();
  bench_cut_row("open sheet, 53,633 vertices", "49.9 ms", "0.06 / 0.25 ms", "sheet", 106496, 104, cuts);
  bench_cut_row("steak 2641/5278, 85/137", "9.4 ms", "0.05 ms", "steak", 0, 137, cuts);
  bench_cut_row("closed sheet, about 53,000 vertices", "", "0.15 / 0.5 ms", "closed-sheet", 106496, 104, cuts);
  bench_cut_row("open sheet 3,425 vertices, 104 collision triangles", "14.6 ms", "", "sheet", 6656, 104, cuts);
  bench_cut_row("closed sheet  10,000 triangles, 104 collision", "", "", "closed-sheet", 10400, 104, cuts);
  bench_cut_row("closed sheet 100,000 triangles, 1500 collision (same ratio)", "", "within 1.5 times", "closed-sheet", 150000, 1500, cuts);
  bench_step("step, 81 hexahedra, 1 ms, 20 kPa", 1e-3, 20e3, "2.5-3.5 ms", "0.1 ms", {9, 9, 1}, "sheet");
  bench_step("step, 81 hexahedra, 16.7 ms, 20 kPa", 1.0 / 60, 20e3, "2.5-3.5 ms", "0.1 ms", {9, 9, 1}, "sheet");
  bench_step("step, 81 hexahedra, 1 ms, 4 MPa", 1e-3, 4e6, "2.5-3.5 ms", "0.4 ms", {9, 9, 1}, "sheet");
  bench_step("step, 81 hexahedra, 16.7 ms, 4 MPa", 1.0 / 60, 4e6, "2.5-3.5 ms", "0.4 ms", {9, 9, 1}, "sheet");
  bench_surface();
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  fmt::print("peak memory of this program {:.2f} GB\n", static_cast<double>(usage.ru_maxrss) / 1e6);
  return 0;
}
