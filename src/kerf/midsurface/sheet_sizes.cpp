#include "kerf/midsurface/sheet_sizes.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "kerf/midsurface/border_curve.h"
#include "kerf/midsurface/laplacian.h"
#include "kerf/midsurface/tolerances.h"

namespace kerf::mid {
namespace {

constexpr double kTriangleArea = 0.4330127018922193;  // of an edge squared: root of 3, over 4
constexpr double kSagitta = 0.2;                      // of the half thickness: how far a chord may leave the bend
constexpr double kSmallest = 0.15;                    // of the largest size
constexpr double kGrading = 0.5;                      // change of size over distance
constexpr double kFewestBorderEdges = 6;
constexpr double kShorter = 0.85;  // from one length that is tried to the next
constexpr int kChordSamples = 8;   // of a chord
constexpr double kNeedCap = 3;     // times the largest size: what flat parts are counted with in `need`

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

/// A border loop, with its material on the left.
class Border {
 public:
  /// `least`: metres; no edge is asked to be shorter, and what turns within that is a corner.
  Border(const MidSheet& sheet, const std::vector<std::int32_t>& loop, double least)
      : curve_(points(sheet, loop)), least_(least) {
    for (const std::int32_t v : loop) normal_.push_back(sheet.normal[v]);
    for (std::size_t i = 0; i < loop.size(); ++i)
      if (curve_.turn(curve_.start(i), least) > kCornerTurn) corners_.push_back(curve_.start(i));
  }
  /// Of edges around point i, at most and at least so long, the longest that leaves the curve by `hollow` metres where that is hollow. Corners do not count: they
  /// are vertices.
  [[nodiscard]] double longest(std::size_t i, double most, double hollow) const {
    const double s = curve_.start(i);
    double back = 0.5 * most, forth = 0.5 * most;
    for (const double c : corners_) {
      back = std::min(back, curve_.ahead(c, s) - least_);
      forth = std::min(forth, curve_.ahead(s, c) - least_);
    }
    if (back <= 0 || forth <= 0) return most;
    double length = most;
    while (length > least_ &&
           bulge(s - std::min(back, 0.5 * length), s + std::min(forth, 0.5 * length), normal_[i]) > hollow)
      length *= kShorter;
    return std::min(most, std::max(length, least_));
  }

 private:
  static std::vector<Vec3> points(const MidSheet& sheet, const std::vector<std::int32_t>& loop) {
    std::vector<Vec3> out;
    for (const std::int32_t v : loop) out.push_back(sheet.mesh.position[v]);
    return out;
  }
  /// Metres by which the curve reaches into the material at most, over the chord between two places on it: of the arc that does so as far on the mean, so
  /// that noise is no hollow.
  [[nodiscard]] double bulge(double from, double to, Vec3 normal) const {
    const Vec3 a = curve_.at(from), inward = normalized(cross(normal, curve_.at(to) - a));
    double sum = 0, arc = 0;
    for (int k = 1; k < kChordSamples; ++k) {
      const double t = static_cast<double>(k) / kChordSamples;
      sum += dot(curve_.at(from + t * (to - from)) - a, inward);
      arc += 4 * t * (1 - t);
    }
    return sum / arc;
  }
  BorderCurve curve_;
  std::vector<Vec3> normal_;
  std::vector<double> corners_;  // metres along the curve
  double least_;
};

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
      n += area[v] / (kTriangleArea * s * s);
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

void follow_hollows(const MidSheet& sheet, bool add, double& target, Column<double>& limit) {
  const SurfaceMesh& m = sheet.mesh;
  const SheetSizes without = sheet_sizes(sheet, target, limit);
  const double edge = std::sqrt(total_area(m) / (kTriangleArea * target));
  for (const std::vector<std::int32_t>& loop : border_loops(m)) {
    double half_thickness = 0;
    for (const std::int32_t v : loop) half_thickness += sheet.half_thickness[v] / static_cast<double>(loop.size());
    const Border border(sheet, loop, std::max(kLeastHollowEdge * edge, kHollowThickness * 2 * half_thickness));
    for (std::size_t i = 0; i < loop.size(); ++i) limit[loop[i]] = border.longest(i, limit[loop[i]], kHollow * edge);
  }
  if (!add) return;
  Column<double> graded = limit;
  grade(m, graded);
  const Column<double> area = vertex_areas(m);
  double asked = 0;
  for (std::int32_t v = 0; v < m.vertex_count(); ++v) {
    const double s = std::min(without.size[v], graded[v]);
    asked += area[v] / (kTriangleArea * s * s);
  }
  target = std::min(asked, std::max(target, kMostByNeed));
}

}  // namespace kerf::mid
