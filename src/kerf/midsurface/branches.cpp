#include "kerf/midsurface/branches.h"

#include <algorithm>
#include <cmath>
#include <queue>

namespace kerf::mid {
namespace {

constexpr double kSureFace = 0.3;            // least confidence of faces that are asked
constexpr double kJump = 0.75;               // of the thickness: opposite points farther apart than this are a jump
constexpr double kJumpEdges = 2.5;           // lengths of the edge between: smaller jumps are its own
constexpr double kDetour = 2, kSlack = 0.5;  // the way round on the other side: times the jump, plus thicknesses

Vec3 point_at(const SurfaceMesh& m, const Pair& p) {
  const auto [a, b, c] = m.corners(p.face);
  return p.barycentric[0] * a + p.barycentric[1] * b + p.barycentric[2] * c;
}

/// Is there a way from face `from` to face `to` over faces of one sign that is not longer than `limit`?
class SideWalk {
 public:
  SideWalk(const SurfaceMesh& m, const Column<double>& field)
      : m_(m), field_(field), seen_(static_cast<std::size_t>(m.face_count()), 0) {}
  bool reaches(std::int32_t from, std::int32_t to, double limit) {
    ++stamp_;
    const bool side = field_at(m_, field_, from) > 0;
    using Entry = std::pair<double, std::int32_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    queue.emplace(0, from);
    while (!queue.empty()) {
      const auto [d, f] = queue.top();
      queue.pop();
      if (f == to) return true;
      if (seen_[f] == stamp_) continue;
      seen_[f] = stamp_;
      const Vec3 c = m_.centroid(f);
      for (int k = 0; k < 3; ++k) {
        const std::int32_t t = m_.twin[3 * f + k];
        if (t < 0) continue;
        const std::int32_t g = t / 3;
        const double next = d + norm(m_.centroid(g) - c);
        if (seen_[g] == stamp_ || next > limit || (field_at(m_, field_, g) > 0) != side) continue;
        queue.emplace(next, g);
      }
    }
    return false;
  }

 private:
  const SurfaceMesh& m_;
  const Column<double>& field_;
  Column<std::int32_t> seen_;
  std::int32_t stamp_ = 0;
};

}  // namespace

Branches find_branches(const SurfaceMesh& m, const Pairing& pairing, const SideLabels& labels) {
  Branches out;
  out.flag.assign(static_cast<std::size_t>(m.face_count()), 0);
  SideWalk walk(m, labels.field);
  const auto sure = [&](std::int32_t f) {
    const Pair& p = pairing.pair[f];
    return p.face >= 0 && std::min(p.confidence, pairing.pair[p.face].confidence) > kSureFace;
  };
  for (std::int32_t h = 0; h < m.origin.count(); ++h) {
    if (!m.is_edge(h) || m.twin[h] < 0) continue;
    const std::int32_t f = h / 3, g = m.twin[h] / 3;
    if (!sure(f) || !sure(g)) continue;
    const Pair &p = pairing.pair[f], &q = pairing.pair[g];
    const double length = m.length(h), t = std::min(p.distance, q.distance);
    const double least = std::max(kJumpEdges * length, kJump * t);
    bool fork = false;
    if ((field_at(m, labels.field, f) > 0) != (field_at(m, labels.field, g) > 0)) {
      fork = norm(point_at(m, p) - m.centroid(g)) > least && norm(point_at(m, q) - m.centroid(f)) > least;
    } else if (const double jump = norm(point_at(m, p) - point_at(m, q)); jump > least) {
      fork = !walk.reaches(p.face, q.face, kDetour * jump + kSlack * t + 2 * length);
    }
    if (!fork) continue;
    out.flag[static_cast<std::size_t>(f)] = out.flag[static_cast<std::size_t>(g)] = 1;
    out.length += length;
  }
  return out;
}

}  // namespace kerf::mid
