// Bodies that the benchmarks cut.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "kerf/binding/bind.h"
#include "kerf/session/session.h"

namespace kerf::bench {

struct BenchBody {
  std::string model;
  std::size_t visual = 0, collision = 0;  ///< triangles; 0: the model's own
  int cells = 0;                          ///< cells x cells x 1 instead of the model's own lattice; 0: the model's
};

/// Time steps of the benchmarks, s.
inline constexpr double kBenchStep = 0.01;

/// A scene with that body, held at its low end in x.
Scene bench_scene(const BenchBody& body);
/// dust: of [cut]; unset: the default.
Result<Session> bench_session(const BenchBody& body, std::optional<double> dust = {});
/// The second steak or the meniscus at 1 kHz, held at one end, lying on a plane, with contact and self-contact.
Scene haptic_scene(const std::string& model);
/// The sheet of table 6 over four fixed balls of 672 triangles together, 1 cm under it, with contact; `mass` of the sheet in kg.
Scene sheet_over_balls(std::size_t collision, double mass);

struct BindTiming {
  double local = 0, exact = 0;              ///< s of this thread, median; 0: not measured
  BindReport report;                        ///< of the last run, with local paths when there are any
  double visual_vertices_per_triangle = 0;  ///< mean over collision triangles, those on its edges and corners included
  double visual_triangles_per_triangle = 0;
  std::size_t collision_vertices = 0, collision_triangles = 0;
};
/// Pre-processing alone, `repeats` times with each of the wanted kinds of paths.
Result<BindTiming> time_binding(const BenchBody& body, int repeats, bool exact_paths, bool local_paths);

}  // namespace kerf::bench
