// Whole frames at 1 kHz, as a haptic device would ask for them (the row `haptic` of `kerf bench paper`), stage by stage: what the slowest frames
// spend their time on. A body lies on a plane, held at one end, while a blade moves through it in every frame; contact and self-contact are on.
// CPU time of the thread. The frames of a run are the same in the next to the last bit, so the least time of each over some runs is what it costs
// where nothing else slows the machine down.
//
//   frame_bench [--strokes n] [--poses n] [--runs n] [--passes n] [--csv FILE] [steak | meniscus]
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "bench/bench_bodies.h"
#include "bench/session_timing.h"

namespace {

using namespace kerf;

struct Frame {
  double all = 0, cut = 0, find = 0, forces = 0, setup = 0, solve = 0, response = 0, surface = 0;
  int rows = 0, pressing = 0, iterations = 0, passes = 0, parts = 0;
};

Status run(const std::string& model, int strokes, int poses, int passes, std::vector<Frame>& frames, double& deepest) {
  Scene scene = bench::haptic_scene(model);
  if (passes > 0) scene.contact.passes = passes;
  auto session = Session::create(std::move(scene));
  if (!session) return session.error();
  KERF_TRY(session->step(500));
  const auto done = bench::time_cutting_frames(
      *session, strokes, poses, [&](const SessionStep& step, double cut, double stepping, double surface) {
        const StepReport& m = step.mechanics;
        frames.push_back({cut + stepping + surface, cut, step.detection, m.seconds_forces, m.seconds_setup,
                          m.seconds_solve, m.seconds_contact, surface, m.contacts, m.pressing, m.iterations, m.passes,
                          step.parts});
        deepest = std::max(deepest, m.deepest_overlap);
      });
  return done ? Status{} : Status(done.error());
}

}  // namespace

int main(int argc, char** argv) {
  int strokes = 20, poses = 1000, runs = 1, passes = 0;
  std::string csv;
  std::vector<std::string> models;
  for (int i = 1; i < argc; ++i) {
    const std::string a = argv[i];
    if (a == "--strokes" && i + 1 < argc) strokes = std::atoi(argv[++i]);
    else if (a == "--poses" && i + 1 < argc) poses = std::atoi(argv[++i]);
    else if (a == "--runs" && i + 1 < argc) runs = std::atoi(argv[++i]);
    else if (a == "--passes" && i + 1 < argc) passes = std::atoi(argv[++i]);
    else if (a == "--csv" && i + 1 < argc) csv = argv[++i];
    else models.push_back(a);
  }
  if (models.empty()) models = {"steak", "meniscus"};
  fmt::print(
      "us{:<22} {:>6} {:>6} {:>6} {:>6} | {:>4} {:>4} {:>4} {:>4} {:>4} {:>4} {:>4} | {:>5} {:>5} {:>5} {:>6} {:>5}\n",
      "", "median", "99 %", "99.9 %", "most", "cut", "find", "forc", "setp", "solv", "resp", "surf", "rows", "press",
      "CG", "passes", "parts");
  for (const std::string& model : models) {
    std::vector<Frame> frames;
    double deepest = 0;
    for (int r = 0; r < std::max(1, runs); ++r) {
      std::vector<Frame> again;
      if (const Status done = run(model, strokes, poses, passes, again, deepest); !done.ok()) {
        fmt::print("{}: {}\n", model, done.error().message);
        return 1;
      }
      if (frames.empty()) frames = again;
      for (std::size_t i = 0; i < std::min(frames.size(), again.size()); ++i)
        if (again[i].all < frames[i].all) frames[i] = again[i];
    }
    if (!csv.empty())
      if (std::FILE* file = std::fopen(fmt::format("{}-{}.csv", csv, model).c_str(), "w")) {
        fmt::print(file, "all,cut,find,forces,setup,solve,response,surface,rows,pressing,iterations,passes,parts\n");
        for (const Frame& f : frames)
          fmt::print(file, "{:.1f},{:.1f},{:.1f},{:.1f},{:.1f},{:.1f},{:.1f},{:.1f},{},{},{},{},{}\n", 1e6 * f.all,
                     1e6 * f.cut, 1e6 * f.find, 1e6 * f.forces, 1e6 * f.setup, 1e6 * f.solve, 1e6 * f.response,
                     1e6 * f.surface, f.rows, f.pressing, f.iterations, f.passes, f.parts);
        std::fclose(file);
      }
    std::sort(frames.begin(), frames.end(), [](const Frame& a, const Frame& b) { return a.all < b.all; });
    const std::size_t n = frames.size();
    const auto at = [&](double q) {
      return 1e6 * frames[static_cast<std::size_t>(q * static_cast<double>(n - 1))].all;
    };
    // Means over a share of the frames, by time.
    const auto row = [&](const char* name, std::size_t begin, std::size_t end) {
      Frame s;
      for (std::size_t i = begin; i < end; ++i) {
        const Frame& f = frames[i];
        s.cut += f.cut, s.find += f.find, s.forces += f.forces, s.setup += f.setup, s.solve += f.solve,
            s.response += f.response, s.surface += f.surface;
        s.rows += f.rows, s.pressing += f.pressing, s.iterations += f.iterations, s.passes += f.passes,
            s.parts += f.parts;
      }
      const double c = 1.0 / static_cast<double>(std::max<std::size_t>(1, end - begin)), us = 1e6 * c;
      fmt::print(
          "{:<24} {:6.0f} {:6.0f} {:6.0f} {:6.0f} | {:4.0f} {:4.0f} {:4.0f} {:4.0f} {:4.0f} {:4.0f} {:4.0f} | {:5.0f} {:5.0f} {:5.1f} {:6.2f} {:5.2f}\n",
          name, at(0.5), at(0.99), at(0.999), at(1), us * s.cut, us * s.find, us * s.forces, us * s.setup, us * s.solve,
          us * s.response, us * s.surface, c * s.rows, c * s.pressing, c * s.iterations, c * s.passes, c * s.parts);
    };
    row(fmt::format("{}, all", model).c_str(), 0, n);
    row("  slowest hundredth", n - n / 100, n);
    row("  slowest thousandth", n - n / 1000, n);
    fmt::print("  deepest overlap {:.3g} mm\n", 1e3 * deepest);
  }
}
