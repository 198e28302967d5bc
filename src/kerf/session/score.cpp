#include "kerf/session/score.h"

#include <algorithm>
#include <array>
#include <utility>

#include "kerf/base/indexed.h"
#include "kerf/cutting/pieces.h"
#include "kerf/cutting/wall_points.h"
#include "kerf/session/session_impl.h"

namespace kerf {

namespace {

/// Part of a collision triangle.
struct Part {
  std::array<Vec3, 3> place;
  std::array<double, 3> thickness;
};

/// Adds a part to both sums; what the region's border runs through is quartered `depth` times more.
void add_part(const Part& part, const SceneRegion& lesion, int depth, TissueVolume& sum) {
  const auto& [p, t] = part;
  const Vec3 middle = (1.0 / 3) * (p[0] + p[1] + p[2]);
  const std::array<Vec3, 3> half{0.5 * (p[1] + p[2]), 0.5 * (p[2] + p[0]), 0.5 * (p[0] + p[1])};
  int inside = 0;
  for (std::size_t i = 0; i < 3; ++i) inside += (lesion.contains(p[i]) ? 1 : 0) + (lesion.contains(half[i]) ? 1 : 0);
  const bool mixed = inside != 0 && inside != 6;
  if (!mixed || depth == 0) {
    const double volume = 0.5 * norm(cross(p[1] - p[0], p[2] - p[0])) * (t[0] + t[1] + t[2]) / 3;
    (lesion.contains(middle) ? sum.lesion : sum.healthy) += volume;
    return;
  }
  const std::array<double, 3> h{0.5 * (t[1] + t[2]), 0.5 * (t[2] + t[0]), 0.5 * (t[0] + t[1])};
  add_part({{p[0], half[2], half[1]}, {t[0], h[2], h[1]}}, lesion, depth - 1, sum);
  add_part({{half[2], p[1], half[0]}, {h[2], t[1], h[0]}}, lesion, depth - 1, sum);
  add_part({{half[1], half[0], p[2]}, {h[1], h[0], t[2]}}, lesion, depth - 1, sum);
  add_part({half, h}, lesion, depth - 1, sum);
}

}  // namespace

TissueVolume tissue_volume(const CellComplex& body, const SceneRegion& lesion) {
  const CollisionMesh& mesh = body.collision;
  constexpr int n = kLesionDivisions;
  TissueVolume sum;
  for (const CollisionTriangle t : ids<CollisionTriangle>(mesh.face_count())) {
    std::array<Vec3, 3> p;
    std::array<double, 3> thickness{};
    for (std::size_t i = 0; i < 3; ++i) {
      const CollisionVertex v = mesh.origin[CollisionMesh::corner(t, static_cast<int>(i))];
      p[i] = mesh.rest[v];
      thickness[i] = 2 * norm(mesh.offset[v]);
    }
    // Small regions must not fall between the points that are looked at: a few parts to begin with.
    const auto at = [&](int i, int j) {
      const double a = static_cast<double>(i) / n, b = static_cast<double>(j) / n, c = 1 - a - b;
      return std::pair{a * p[0] + b * p[1] + c * p[2], a * thickness[0] + b * thickness[1] + c * thickness[2]};
    };
    const auto add = [&](const auto& x, const auto& y, const auto& z) {
      add_part({{x.first, y.first, z.first}, {x.second, y.second, z.second}}, lesion, kLesionDepth, sum);
    };
    for (int i = 0; i < n; ++i)
      for (int j = 0; i + j < n; ++j) {
        add(at(i, j), at(i + 1, j), at(i, j + 1));
        if (i + j + 1 < n) add(at(i + 1, j + 1), at(i, j + 1), at(i + 1, j));
      }
  }
  return sum;
}

std::optional<TrainerScore> Session::score() const {
  const Impl& s = *impl_;
  if (!s.scene.lesion) return std::nullopt;
  TrainerScore score;
  const TissueVolume now = tissue_volume(s.state.body.complex, *s.scene.lesion);
  const TissueVolume& before = s.tissue_at_start;
  score.lesion_volume = before.lesion;
  score.lesion_removed = before.lesion > 0 ? std::clamp(1 - now.lesion / before.lesion, 0.0, 1.0) : 0;
  score.healthy_removed = std::max(0.0, before.healthy - now.healthy);
  score.healthy_share = before.healthy > 0 ? score.healthy_removed / before.healthy : 0;
  score.loose_pieces = std::max(0, collision_pieces(s.state.body.complex).count - s.pieces_at_start);
  score.roughness = wall_roughness(s.state.body.complex, bare_walls(s.state.body.complex));
  score.largest_force = s.state.largest_tool_force;
  score.time = s.state.time;
  return score;
}

}  // namespace kerf
