#include "kerf/midsurface/sheet_sizes.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "kerf/midsurface/laplacian.h"

namespace kerf::mid {
namespace {

constexpr double kSagitta = 0.2;    // of the half thickness: how far a chord may leave the bend
constexpr double kSmallest = 0.15;  // of the largest size
constexpr double kGrading = 0.5;    // change of size over distance
constexpr double kFewestBorderEdges = 6;
constexpr double kNeedCap = 3;  // times the largest size: what flat parts are counted with in `need`

using Entry = std::pair<double, std::int32_t>;
using Queue = std::priority_queue<Entry, std::vector<Entry>, std::greater<>>;

/// 1 / metres: how fast the normal turns; next to the rim as at the nearest trusted vertex.
Column<double> bend(const MidSheet& sheet) {
  const SurfaceMesh& m = sheet.mesh;
  Column<double> kappa(m.position.size(), 0);
  for (std::int32_t h = 0; h < m.origin.count(); ++h) {
    if (!m.is_edge(h)) continue;
    const std::int32_t a = m.from(h), b = m.to(h);
    if (!sheet.trusted[a] || !sheet.trusted[b]) continue;
    const double k = norm(sheet.normal[a] - sheet.normal[b]) / std::max(m.length(h), 1e-300);
    kappa[a] = std::max(kappa[a], k);
    kappa[b] = std::max(kappa[b], k);
  }
  const Column<std::int32_t> nearest = nearest_trusted(m, sheet.trusted);
  for (std::int32_t v = 0; v < m.vertex_count(); ++v)
    if (nearest[v] >= 0) kappa[v] = kappa[nearest[v]];
  return kappa;
}

void grade(const SurfaceMesh& m, Column<double>& size) {
  Queue queue;
  for (std::int32_t v = 0; v < m.vertex_count(); ++v) queue.emplace(size[v], v);
  while (!queue.empty()) {
    const auto [s, v] = queue.top();
    queue.pop();
    if (s > size[v]) continue;
    m.for_each_neighbour(v, [&, from = s, at = v](std::int32_t u) {
      const double next = from + kGrading * norm(m.position[u] - m.position[at]);
      if (next >= size[u]) return;
      size[u] = next;
      queue.emplace(next, u);
    });
  }
}

}  // namespace

Column<double> border_limits(const MidSheet& sheet) {
  const SurfaceMesh& m = sheet.mesh;
  Column<double> out(m.position.size(), HUGE_VAL);
  for (const std::vector<std::int32_t>& loop : border_loops(m)) {
    double length = 0;
    for (std::size_t i = 0; i < loop.size(); ++i)
      length += norm(m.position[loop[(i + 1) % loop.size()]] - m.position[loop[i]]);
    for (const std::int32_t v : loop) out[v] = length / kFewestBorderEdges;
  }
  return out;
}

SheetSizes sheet_sizes(const MidSheet& sheet, double target, Column<double> limit) {
  const SurfaceMesh& m = sheet.mesh;
  const Column<double> area = vertex_areas(m), kappa = bend(sheet);
  double volume = 0, total = 0;
  for (std::int32_t v = 0; v < m.vertex_count(); ++v) {
    volume += area[v] * sheet.half_thickness[v];
    total += area[v];
  }
  const double half = volume / total, scale = std::sqrt(total);
  // Grading commutes with cutting off at constants, so it is done once.
  Column<double> wanted(m.position.size());
  for (std::int32_t v = 0; v < m.vertex_count(); ++v)
    wanted[v] = std::min(100 * scale, std::sqrt(8 * kSagitta * half / std::max(kappa[v], 1e-12 / scale)));
  grade(m, wanted);
  grade(m, limit);
  const auto size = [&](std::int32_t v, double low, double high) {
    return std::min(limit[v], std::clamp(wanted[v], low, high));
  };
  const auto count = [&](double low, double high) {
    double n = 0;
    for (std::int32_t v = 0; v < m.vertex_count(); ++v) {
      const double s = size(v, low, high);
      n += area[v] / (0.25 * std::sqrt(3.0) * s * s);
    }
    return n;
  };
  double low = 1e-4 * scale, high = 10 * scale;
  for (int i = 0; i < 60; ++i) {
    const double middle = std::sqrt(low * high);
    (count(kSmallest * middle, middle) > target ? low : high) = middle;
  }
  SheetSizes out;
  out.largest = std::sqrt(low * high);
  out.need = count(0, kNeedCap * out.largest);
  out.size.resize(m.position.size());
  for (std::int32_t v = 0; v < m.vertex_count(); ++v) out.size[v] = size(v, kSmallest * out.largest, out.largest);
  return out;
}

}  // namespace kerf::mid
