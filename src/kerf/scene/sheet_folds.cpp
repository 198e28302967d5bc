#include "kerf/scene/sheet_folds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "kerf/binding/tolerances.h"
#include "kerf/mesh/surface_edges.h"
#include "kerf/mesh/surface_measures.h"
#include "kerf/mesh/union_find.h"

namespace kerf {
namespace {

constexpr double kDegrees = 57.29577951308232;
constexpr double kLongFold = 2;  // edges of the collision mesh

Vec3 unit_normal(const TriangleMesh& mesh, std::int32_t triangle) {
  const auto& t = mesh.triangles.raw()[static_cast<std::size_t>(triangle)];
  const Vec3 a = mesh.positions[t[0]];
  return normalized(cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a));
}

struct Fold {
  VertexId a, b;
  double cosine;
};

}  // namespace

Status check_sheet_folds(const TriangleMesh& sheet, std::size_t collision_triangles) {
  std::vector<Fold> folds;
  const std::vector<EdgeUse> uses = edge_uses(sheet.triangles.raw(), sheet.positions.size());
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    if (edge.size() != 2) return;
    const double cosine = dot(unit_normal(sheet, edge[0].half_edge / 3), unit_normal(sheet, edge[1].half_edge / 3));
    if (cosine < kFoldCosine) folds.push_back({VertexId(edge[0].low), VertexId(edge[0].high), cosine});
  });
  if (folds.empty()) return {};
  // Folds that hang together.
  UnionFind along(sheet.positions.size());
  for (const Fold& f : folds) along.join(f.a.value, f.b.value);
  std::vector<double> length(sheet.positions.size(), 0);
  for (const Fold& f : folds)
    length[static_cast<std::size_t>(along.root(f.a.value))] += norm(sheet.positions[f.b] - sheet.positions[f.a]);
  const auto longest = static_cast<std::size_t>(std::max_element(length.begin(), length.end()) - length.begin());
  if (collision_triangles > 0) {
    const double area = surface_measures(sheet).area;
    const double edge = std::sqrt(4 / std::sqrt(3.0) * area / static_cast<double>(collision_triangles));
    if (!(length[longest] > kLongFold * edge)) return {};
  }
  const Fold* worst = nullptr;
  for (const Fold& f : folds)
    if (along.root(f.a.value) == static_cast<std::int32_t>(longest) && (worst == nullptr || f.cosine < worst->cosine))
      worst = &f;
  const Vec3 p = 0.5 * (sheet.positions[worst->a] + sheet.positions[worst->b]);
  return bad_input(fmt::format(
      "the sheet is folded back on itself, by {:.0f} degrees at ({:.4g}, {:.4g}, {:.4g}), at {} of its edges in all; {:.0f} degrees are "
      "the most: unfold it there, or round the fold",
      kDegrees * std::acos(std::clamp(worst->cosine, -1.0, 1.0)), p.x, p.y, p.z, folds.size(),
      kDegrees * std::acos(kFoldCosine)));
}

}  // namespace kerf
