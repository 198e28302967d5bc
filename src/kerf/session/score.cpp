#include "kerf/session/score.h"

#include <algorithm>

#include "kerf/base/indexed.h"
#include "kerf/cutting/pieces.h"
#include "kerf/session/session_impl.h"

namespace kerf {

TissueVolume tissue_volume(const CellComplex& body, const SceneRegion& lesion) {
  const CollisionMesh& mesh = body.collision;
  constexpr int n = kLesionDivisions;
  TissueVolume sum;
  for (const CollisionTriangle t : ids<CollisionTriangle>(mesh.face_count())) {
    Vec3 p[3], offset[3];
    for (int i = 0; i < 3; ++i) {
      const CollisionVertex v = mesh.origin[CollisionMesh::corner(t, i)];
      p[i] = mesh.rest[v];
      offset[i] = mesh.offset[v];
    }
    const double area = 0.5 * norm(cross(p[1] - p[0], p[2] - p[0])) / (n * n);
    const auto add = [&](double a, double b) {  // a small triangle by its middle
      const double c = 1 - a - b;
      const double thickness = 2 * norm(a * offset[0] + b * offset[1] + c * offset[2]);
      (lesion.contains(a * p[0] + b * p[1] + c * p[2]) ? sum.lesion : sum.healthy) += area * thickness;
    };
    for (int i = 0; i < n; ++i)
      for (int j = 0; i + j < n; ++j) {
        add((i + 1.0 / 3) / n, (j + 1.0 / 3) / n);
        if (i + j + 1 < n) add((i + 2.0 / 3) / n, (j + 2.0 / 3) / n);
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
  score.roughness = roughness();
  score.largest_force = s.state.largest_tool_force;
  score.time = s.state.time;
  return score;
}

}  // namespace kerf
