// Whole steps with contact: the paper's second sheet experiment (table 6), a sheet of 1 m with four collision meshes over
// the same four fixed spheres of 672 triangles together, light (1 kg) and draped (20 kg), time step 10 ms, one thread.
// Prints median and 99th percentile of the steps after the sheet has come down (CPU time of the thread), by stage,
// contacts, iterations and passes, deepest overlap in parts of the half thickness, and the speed that is left.
//
//   contact_bench [--dt ms] [--seconds s] [--tolerance t] [--cut] [pattern]
//
// With --cut the sheet is cut by 0.5 m first, and there are rows without self-contact: what the lips cost.
#include <fmt/format.h>

#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "kerf/session/session.h"

namespace {

using namespace kerf;

double percentile(std::vector<double> v, double p) {
  std::sort(v.begin(), v.end());
  return v.empty() ? 0 : v[static_cast<std::size_t>(p * static_cast<double>(v.size() - 1))];
}

double cpu_seconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// kg and Pa of the whole sheet; spheres of radius 0.18 m whose tops lie 1 cm under it.
Scene sheet_over_spheres(std::size_t triangles, double mass, double dt) {
  Scene scene;
  scene.name = "table 6";
  scene.body.model = "sheet";
  scene.body.options.visual_triangles = 6656;
  scene.body.options.collision_triangles = triangles;
  scene.material.young = 5000;
  scene.material.poisson = 0.45;
  scene.material.density = mass / 0.1;
  scene.simulation.time_step = dt;
  scene.simulation.threads = 1;
  for (double x : {-0.25, 0.25})
    for (double y : {-0.25, 0.25}) {
      SceneObstacle& ball = scene.obstacles.emplace_back();
      ball.shape = SceneShape::kMesh;
      ball.model = "ball";
      ball.scale = 0.18;
      ball.position = {x, y, -0.24};
    }
  return scene;
}

double rms(const std::vector<Vec3>& v) {
  double sum = 0;
  for (Vec3 x : v) sum += dot(x, x);
  return std::sqrt(sum / static_cast<double>(v.size()));
}

/// Half a metre across the middle, between two balls.
Status cut(Session& session) {
  const Vec3 up{0, 0, 1};
  KERF_TRY(session.begin_stroke(SceneFrame::kRest, false));
  for (const Vec3 p : {Vec3{-0.2, -0.13, 0}, Vec3{0.22, 0.14, 0}}) KERF_TRY(session.move_blade(p + up, p - up));
  return session.end_stroke();
}

struct Options {
  bool cut = false;
  double dt = 0.01, seconds = 6, tolerance = 0.01;
  int passes = 0;
  double stiffness = 0;
  std::string pattern;
};

void run(const std::string& name, const Scene& scene, const Options& o) {
  if (name.find(o.pattern) == std::string::npos) return;
  auto made = Session::create(scene);
  if (!made) {
    fmt::print("{}: {}\n", name, made.error().message);
    return;
  }
  Session& session = *made;
  if (o.cut) {
    if (const Status done = cut(session); !done.ok()) return fmt::print("{}: {}\n", name, done.error().message);
  }
  std::vector<double> total, detection, forces, setup, solve, contact, iterations, passes;
  double deepest = 0, deepest_late = 0, residual_speed = 0;
  SessionStep last;
  const int steps = static_cast<int>(std::lround(o.seconds / o.dt));
  for (int i = 0; i < steps; ++i) {
    const double before = cpu_seconds();
    auto step = session.step();
    const double after = cpu_seconds();
    if (!step) {
      fmt::print("{}: step {}: {}\n", name, i, step.error().message);
      return;
    }
    last = *step;
    deepest = std::max(deepest, last.mechanics.deepest_overlap);
    if (i < steps / 3) continue;
    total.push_back(after - before);
    detection.push_back(last.detection);
    forces.push_back(last.mechanics.seconds_forces);
    setup.push_back(last.mechanics.seconds_setup);
    solve.push_back(last.mechanics.seconds_solve);
    contact.push_back(last.mechanics.seconds_contact);
    iterations.push_back(last.mechanics.iterations);
    passes.push_back(last.mechanics.passes);
    if (i >= steps - 50) {
      deepest_late = std::max(deepest_late, last.mechanics.deepest_overlap);
      residual_speed = std::max(residual_speed, rms(session.node_velocities()));
    }
  }
  const auto us = [](const std::vector<double>& v) { return 1e6 * percentile(v, 0.5); };
  fmt::print(
      "{:<22} {:6.3f} {:6.3f} {:6.3f} | {:4.0f} {:4.0f} {:4.0f} {:4.0f} {:4.0f} | {:4} {:4} | {:4.0f} {:3.0f} {:3.0f} | {:6.2f} {:6.2f} | {:.1e}\n",
      name, 1e3 * percentile(total, 0.5), 1e3 * percentile(total, 0.99), 1e3 * percentile(total, 1), us(detection),
      us(forces), us(setup), us(solve), us(contact), last.mechanics.contacts, last.mechanics.pressing,
      percentile(iterations, 0.5), percentile(passes, 0.5), percentile(passes, 0.99), 100 * deepest / 0.05,
      100 * deepest_late / 0.05, residual_speed);
}

}  // namespace

int main(int argc, char** argv) {
  Options o;
  for (int i = 1; i < argc; ++i) {
    const std::string a = argv[i];
    const auto number = [&] { return i + 1 < argc ? std::atof(argv[++i]) : 0; };
    if (a == "--dt") o.dt = 1e-3 * number();
    else if (a == "--seconds") o.seconds = number();
    else if (a == "--tolerance") o.tolerance = number();
    else if (a == "--passes") o.passes = static_cast<int>(number());
    else if (a == "--cut") o.cut = true;
    else if (a == "--stiffness") o.stiffness = number();
    else o.pattern = a;
  }
  fmt::print(
      "dt {} ms, tolerance {}\n{:<22} {:>6} {:>6} {:>6} | {:>4} {:>4} {:>4} {:>4} {:>4} | {:>4} {:>4} | {:>4} {:>3} {:>3} | {:>6} {:>6} | {}\n",
      1e3 * o.dt, o.tolerance, "ms, us", "median", "99 %", "most", "find", "forc", "setp", "solv", "resp", "rows",
      "pres", "CG", "ps", "99", "deep%", "rest%", "rms m/s");
  for (double mass : {1.0, 20.0})
    for (std::size_t triangles : {104, 500, 1500, 6656}) {
      Scene scene = sheet_over_spheres(triangles, mass, o.dt);
      scene.simulation.tolerance = o.tolerance;
      if (o.passes > 0) scene.contact.passes = o.passes;
      if (o.stiffness > 0) scene.contact.stiffness = o.stiffness;
      const std::string name = fmt::format("{} {}", mass > 10 ? "draped" : "light", triangles);
      run(name, scene, o);
      if (!o.cut) continue;
      scene.contact.self = false;
      run(name + " without itself", scene, o);
    }
}
