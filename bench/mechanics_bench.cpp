// Time steps of clamped, swinging sheets: 5 mm cells, one cell thick, density 1000, Poisson's ratio 0.45, one
// edge held. One thread. Prints median and 99th percentile of the steps of the first 0.7 s (at least 60
// steps) in CPU time of the thread, the median on the clock on the wall, per stage too (other programs on the
// machine disturb those), and iterations.
//
//   mechanics_bench [pattern]    only the rows whose name contains the pattern
#include <fmt/format.h>

#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <vector>

#include "kerf/mechanics/step.h"

namespace {

using namespace kerf;

constexpr double h = 0.005;

// With `partly_filled` every cell has a matrix of its own (the same material, integrated by points).
MechanicsModel sheet(int nx, int ny, double young, bool partly_filled = false) {
  MechanicsModel model({h, h, h});
  Material material;
  material.young = young;
  if (!model.add_material(material)) std::abort();
  const auto node = [&](int x, int y, int z) {
    return NodeId(static_cast<std::int32_t>((z * (ny + 1) + y) * (nx + 1) + x));
  };
  for (int z = 0; z < 2; ++z)
    for (int y = 0; y <= ny; ++y)
      for (int x = 0; x <= nx; ++x) model.add_node({x * h, y * h, z * h}, {x, y, z});
  for (int y = 0; y < ny; ++y)
    for (int x = 0; x < nx; ++x) {
      MechanicsElement e;
      for (int c = 0; c < 8; ++c) e.nodes[c] = node(x + (c & 1), y + (c >> 1 & 1), c >> 2 & 1);
      const auto points = full_cell_points({h, h, h});
      const Status set =
          partly_filled ? model.set_element(HexId(y * nx + x), e, points) : model.set_element(HexId(y * nx + x), e);
      if (!set.ok()) std::abort();
    }
  for (int z = 0; z < 2; ++z)
    for (int y = 0; y <= ny; ++y) model.fix_node(node(0, y, z));
  return model;
}

// Gravity turns over this many times a second, so that damped sheets keep swinging.
constexpr double kShake = 1.5;

double percentile(std::vector<double> v, double p) {
  std::sort(v.begin(), v.end());
  return v[static_cast<std::size_t>(p * static_cast<double>(v.size() - 1))];
}

double cpu_seconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

void swing(const std::string& name, int nx, int ny, double young, double dt, Preconditioner preconditioner,
           bool partly_filled = false) {
  MechanicsModel model = sheet(nx, ny, young, partly_filled);
  MechanicsState state = rest_state(model);
  StepWorkspace workspace;
  StepOptions options;
  options.dt = dt;
  options.preconditioner = preconditioner;
  std::vector<double> total, wall, forces, setup, solve, iterations;
  int two_level = 0;
  const int steps = std::max(60, static_cast<int>(0.7 / dt));
  for (int i = 0; i < steps; ++i) {
    options.gravity = {0, 0, -9.81 * std::cos(2 * 3.14159265358979 * kShake * i * dt)};
    const double start = cpu_seconds();
    const Result<StepReport> report = step(model, state, options, workspace);
    const double seconds = cpu_seconds() - start;
    if (!report) {
      fmt::print("{}: {}\n", name, report.error().message);
      return;
    }
    if (i < 2) continue;  // the first steps allocate
    total.push_back(1e3 * seconds);
    wall.push_back(1e3 * report->seconds_total);
    forces.push_back(1e3 * report->seconds_forces);
    setup.push_back(1e3 * report->seconds_setup);
    solve.push_back(1e3 * report->seconds_solve);
    iterations.push_back(report->iterations);
    two_level += report->two_level ? 1 : 0;
  }
  fmt::print("{:<44} {:8.3f} {:8.3f} {:8.3f}   {:7.3f} {:7.3f} {:7.3f}   {:5.0f} {:5.0f}   {:3.0f} %\n", name,
             percentile(total, 0.5), percentile(total, 0.99), percentile(wall, 0.5), percentile(forces, 0.5),
             percentile(setup, 0.5), percentile(solve, 0.5), percentile(iterations, 0.5), percentile(iterations, 1),
             100.0 * two_level / static_cast<double>(total.size()));
}

// After a change of the topology: what the next step pays to derive its structure anew.
void rebuild(int nx, int ny, bool partly_filled) {
  MechanicsModel model = sheet(nx, ny, 20e3, partly_filled);
  model.refresh_coarse();
  std::vector<double> plain, coarse;
  for (int i = 0; i < 200; ++i) {
    const HexId id(i % (nx * ny));
    const MechanicsElement e = model.element(id);
    const auto points = full_cell_points({h, h, h});
    if (!(partly_filled ? model.set_element(id, e, points) : model.set_element(id, e)).ok()) std::abort();
    const auto a = std::chrono::steady_clock::now();
    model.refresh();
    const auto b = std::chrono::steady_clock::now();
    model.refresh_coarse();
    const auto c = std::chrono::steady_clock::now();
    plain.push_back(std::chrono::duration<double, std::micro>(b - a).count());
    coarse.push_back(std::chrono::duration<double, std::micro>(c - b).count());
  }
  fmt::print("rebuild after a change, {} {} cells: structure {:.1f} us, coarse structure {:.1f} us (medians)\n",
             nx * ny, partly_filled ? "partly filled" : "full", percentile(plain, 0.5), percentile(coarse, 0.5));
}

void matrix_of_partly_filled() {
  const Material material;
  std::array<double, 27> volumes;
  volumes.fill(1e-9);
  std::vector<double> times;
  double sum = 0;
  for (int i = 0; i < 2000; ++i) {
    volumes[i % 27] *= 0.999;
    const auto a = std::chrono::steady_clock::now();
    sum += partly_filled_matrix(ElementFormulation::kIncompatible, material, {0.005, 0.005, 0.005},
                                material_points_27(volumes))[0];
    times.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - a).count());
  }
  fmt::print("matrix of a partly filled cell, 27 points: {:.1f} us (median){}\n", percentile(times, 0.5),
             sum > 0 ? "" : "!");
}

}  // namespace

int main(int argc, char** argv) {
  const std::string pattern = argc > 1 ? argv[1] : "";
  struct Size {
    const char* name;
    int nx, ny;
  };
  fmt::print("{:<44} {:>8} {:>8} {:>8}   {:>7} {:>7} {:>7}   {:>5} {:>5}   two-level\n", "ms a step", "median", "99 %",
             "wall", "forces", "setup", "solve", "iter", "most");
  for (const Size& size : {Size{"200 nodes", 9, 9}, Size{"968 nodes", 21, 21}, Size{"10,082 nodes", 70, 70}})
    for (double young : {20e3, 4e6})
      for (double dt : {1e-3, 1.0 / 60})
        for (Preconditioner p : {Preconditioner::kAdaptive, Preconditioner::kTwoLevel, Preconditioner::kBlockJacobi}) {
          if (size.nx > 50 && (dt < 0.01 || p == Preconditioner::kBlockJacobi) && pattern.empty()) continue;
          const std::string name =
              fmt::format("{}, {}, {:.1f} ms, {}", size.name, young > 1e6 ? "stiff" : "soft", 1e3 * dt,
                          p == Preconditioner::kAdaptive   ? "adaptive"
                          : p == Preconditioner::kTwoLevel ? "two-level"
                                                           : "block-Jacobi");
          if (name.find(pattern) != std::string::npos) swing(name, size.nx, size.ny, young, dt, p);
        }
  for (double young : {20e3, 4e6})
    for (double dt : {1e-3, 1.0 / 60}) {
      const std::string name =
          fmt::format("200 nodes, all partly filled, {}, {:.1f} ms", young > 1e6 ? "stiff" : "soft", 1e3 * dt);
      if (name.find(pattern) != std::string::npos) swing(name, 9, 9, young, dt, Preconditioner::kAdaptive, true);
    }
  if (pattern.empty()) {
    rebuild(9, 9, false);
    rebuild(9, 9, true);
    rebuild(70, 70, false);
    matrix_of_partly_filled();
  }
  return 0;
}
