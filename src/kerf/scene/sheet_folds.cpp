#include "kerf/scene/sheet_folds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "kerf/base/degrees.h"
#include "kerf/binding/tolerances.h"
#include "kerf/mesh/surface_edges.h"
#include "kerf/mesh/surface_measures.h"
#include "kerf/mesh/union_find.h"
#include "kerf/scene/tolerances.h"

namespace kerf {
namespace {

Vec3 unit_normal(const TriangleMesh& mesh, std::int32_t triangle) {
  const auto& t = mesh.triangles.raw()[static_cast<std::size_t>(triangle)];
  const Vec3 a = mesh.positions[t[0]];
  return normalized(cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a));
}

struct Fold {
  VertexId a, b;
  double cosine;
  Vec3 middle;
};

std::vector<Fold> find_folds(const TriangleMesh& sheet) {
  std::vector<Fold> folds;
  const std::vector<EdgeUse> uses = edge_uses(sheet.triangles.raw(), sheet.positions.size());
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    if (edge.size() != 2) return;
    const double cosine = dot(unit_normal(sheet, edge[0].half_edge / 3), unit_normal(sheet, edge[1].half_edge / 3));
    if (!(cosine < kFoldCosine)) return;
    const VertexId a(edge[0].low), b(edge[0].high);
    folds.push_back({a, b, cosine, 0.5 * (sheet.positions[a] + sheet.positions[b])});
  });
  return folds;
}

/// Mean edge of a collision mesh of so many triangles.
double collision_edge(const TriangleMesh& sheet, std::size_t triangles) {
  return std::sqrt(4 / std::sqrt(3.0) * surface_measures(sheet).area / static_cast<double>(triangles));
}

/// Of the folds that hang together, those that reach furthest.
struct LongestFold {
  Fold sharpest;
  double reach = 0;  ///< metres: the diagonal of their box
};
LongestFold longest_of(const std::vector<Fold>& folds, const TriangleMesh& sheet) {
  UnionFind along(sheet.positions.size());
  for (const Fold& f : folds) along.join(f.a.value, f.b.value);
  std::vector<Box3> box(sheet.positions.size());
  const auto group = [&](const Fold& f) { return static_cast<std::size_t>(along.root(f.a.value)); };
  for (const Fold& f : folds) {
    box[group(f)].add(sheet.positions[f.a]);
    box[group(f)].add(sheet.positions[f.b]);
  }
  const auto longest = static_cast<std::size_t>(
      std::max_element(box.begin(), box.end(),
                       [](const Box3& a, const Box3& b) { return a.diagonal() < b.diagonal(); }) -
      box.begin());
  LongestFold out{folds.front(), box[longest].diagonal()};
  out.sharpest.cosine = 1;
  for (const Fold& f : folds)
    if (group(f) == longest && f.cosine < out.sharpest.cosine) out.sharpest = f;
  return out;
}

Error folded(const Fold& f, std::size_t edges) {
  return bad_input(fmt::format(
      "the sheet is folded back on itself, by {:.0f} degrees at ({:.4g}, {:.4g}, {:.4g}), at {} of its edges in all; {:.0f} degrees are "
      "the most: unfold it there, or round the fold",
      kDegrees * std::acos(std::clamp(f.cosine, -1.0, 1.0)), f.middle.x, f.middle.y, f.middle.z, edges,
      kDegrees * std::acos(kFoldCosine)));
}

}  // namespace

Status check_sheet_folds(const TriangleMesh& sheet, std::size_t collision_triangles) {
  const std::vector<Fold> folds = find_folds(sheet);
  if (folds.empty()) return {};
  const LongestFold longest = longest_of(folds, sheet);
  if (collision_triangles > 0 && !(longest.reach > kLongFold * collision_edge(sheet, collision_triangles))) return {};
  return folded(longest.sharpest, folds.size());
}

Status check_sheet_folds_near(const TriangleMesh& sheet, std::size_t collision_triangles, Vec3 place) {
  const std::vector<Fold> folds = find_folds(sheet);
  const double reach = kFaultReach * collision_edge(sheet, collision_triangles);
  std::vector<Fold> near;
  for (const Fold& f : folds)
    if (norm(f.middle - place) <= reach) near.push_back(f);
  if (near.empty()) return {};
  return folded(longest_of(near, sheet).sharpest, folds.size());
}

}  // namespace kerf
