#include "kerf/midsurface/surface_filter.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "kerf/base/parallel.h"

namespace kerf::mid {
namespace {

constexpr std::size_t kFilterGrain = 4096;
constexpr double kRough = 9 * 0.017453292519943295;  // median dihedral angle that noise begins at
constexpr double kCoarse =
    25 * 0.017453292519943295;  // times edge / thickness: coarse but clean surfaces bend that much
constexpr double
    kSteps = 0.15,
    kCoarseSteps = 0.4;  // share of the edges that turn by kStairStep that staircases begin at; times edge / thickness
constexpr double kStairStep = 0.9396926207859084;  // cosine of 20 degrees
constexpr int kMaxSteps = 20;
constexpr int kSpikeRounds = 3;
constexpr double kAlone = 2;  // times what is next to it

template <class Fn>
void for_each_vertex(const SurfaceMesh& m, Fn&& f) {
  parallel_for(m.position.size(), kFilterGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v)
      if (m.has_vertex(static_cast<std::int32_t>(v))) f(static_cast<std::int32_t>(v));
  });
}

Vec3 ring_mean(const SurfaceMesh& m, std::int32_t v, int& n) {
  Vec3 sum;
  n = 0;
  m.for_each_neighbour(v, [&](std::int32_t u) {
    sum += m.position[u];
    ++n;
  });
  return (1.0 / n) * sum;
}

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::int32_t remove_spikes(SurfaceMesh& m, std::vector<Vec3>& places) {
  const double edge = mean_edge(m);
  // `out`: along the normal. A corner of a flat part whose triangles are long is far from its neighbours' mean, but within the part.
  Column<double> away(m.position.size(), 0), out(m.position.size(), 0), radius(m.position.size(), 0);
  Column<Vec3> mean(m.position.size());
  for_each_vertex(m, [&](std::int32_t v) {
    int n = 0;
    mean[v] = ring_mean(m, v, n);
    away[v] = norm(m.position[v] - mean[v]);
    out[v] = std::fabs(dot(m.position[v] - mean[v], vertex_normal(m, v)));
    double r = 0;
    m.for_each_neighbour(v, [&](std::int32_t u) { r += norm(m.position[u] - mean[v]); });
    radius[v] = r / n;
  });
  std::vector<double> sorted(away);
  const double limit = std::max(6 * median(sorted), 0.9 * edge);
  std::vector<std::int32_t> spikes;
  for (std::int32_t v = 0; v < m.vertex_count(); ++v) {
    if (!m.has_vertex(v) || out[v] <= limit || out[v] <= 0.9 * radius[v]) continue;
    // A spike is alone: corners and edges of coarse bodies are as far from their neighbours' mean, but so is what is next to
    // them.
    bool largest = true;
    std::vector<double> around;
    m.for_each_neighbour(v, [&](std::int32_t u) {
      largest = largest && (away[u] < away[v] || (away[u] == away[v] && u > v));
      around.push_back(away[u]);
    });
    // Of the neighbours one may be another spike.
    std::partial_sort(around.begin(), around.begin() + 2, around.end(), std::greater<>());
    if (largest && away[v] > kAlone * around[1]) spikes.push_back(v);
  }
  for (const std::int32_t v : spikes) {
    if (places.size() < 100) places.push_back(m.position[v]);
    m.position[v] = mean[v];
  }
  return static_cast<std::int32_t>(spikes.size());
}

/// How neighbouring triangles turn: noise shows in the median, the steps of voxels, flat in between, in the share of sharp edges.
struct Roughness {
  double median = 0;  ///< radians
  double steps = 0;   ///< share of the edges
};
Roughness roughness(const SurfaceMesh& m) {
  Column<Vec3> normal(static_cast<std::size_t>(m.face_count()));
  parallel_for(normal.size(), kFilterGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f)
      normal[static_cast<std::int32_t>(f)] = m.normal(static_cast<std::int32_t>(f));
  });
  std::vector<double> cosines;
  cosines.reserve(m.origin.size() / 2);
  for (std::int32_t h = 0; h < m.origin.count(); ++h)
    if (m.is_edge(h) && m.twin[h] >= 0) cosines.push_back(dot(normal[h / 3], normal[m.twin[h] / 3]));
  if (cosines.empty()) return {};
  const auto steps = std::count_if(cosines.begin(), cosines.end(), [](double c) { return c < kStairStep; });
  return {std::acos(std::clamp(median(cosines), -1.0, 1.0)),
          static_cast<double>(steps) / static_cast<double>(cosines.size())};
}

/// Taubin: a step that smooths and one that lets it grow back.
void smooth_once(SurfaceMesh& m) {
  for (const double factor : {0.5, -0.52}) {
    Column<Vec3> moved = m.position;
    for_each_vertex(m, [&](std::int32_t v) {
      int n = 0;
      const Vec3 mean = ring_mean(m, v, n);
      moved[v] = m.position[v] + factor * (mean - m.position[v]);
    });
    m.position = std::move(moved);
  }
}

}  // namespace

double mean_thickness(const SurfaceMesh& mesh) { return 2 * std::fabs(enclosed_volume(mesh)) / total_area(mesh); }

Result<FilterReport> filter_surface(SurfaceMesh& mesh, const Progress& progress) {
  FilterReport report;
  const auto ask = [&](double done) { return progress("mid-surface: filter", done / (kSpikeRounds + kMaxSteps)); };
  for (int round = 0; round < kSpikeRounds; ++round) {
    KERF_TRY(ask(round));
    const std::int32_t n = remove_spikes(mesh, report.spike_places);
    report.spikes += n;
    if (n == 0) break;
  }
  Roughness rough = roughness(mesh);
  report.roughness = rough.median;
  report.steps = rough.steps;
  for (; report.smoothing_steps < kMaxSteps; rough = roughness(mesh)) {
    KERF_TRY(ask(kSpikeRounds + report.smoothing_steps));
    const double fineness = mean_edge(mesh) / mean_thickness(mesh);
    if (rough.median <= std::max(kRough, kCoarse * fineness) &&
        rough.steps <= std::max(kSteps, kCoarseSteps * fineness))
      break;
    smooth_once(mesh);
    ++report.smoothing_steps;
  }
  return report;
}

}  // namespace kerf::mid
