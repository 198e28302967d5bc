#include "kerf/mechanics/speed_cap.h"

#include <algorithm>
#include <cmath>

#include "kerf/mechanics/tolerances.h"

namespace kerf {
namespace {

double limit_of(const RigidPieces& pieces, std::int32_t piece, const SpeedLimits& limits) {
  return std::max(limits.reached, kMostWay * pieces.size[static_cast<std::size_t>(piece)] / limits.time);
}

/// Of pieces in flight; others are measured against rest.
void find_means(const MechanicsModel& model, const MechanicsState& state, std::span<const std::uint8_t> touched,
                SpeedCapWork& work) {
  const MechanicsModel::Structure& s = model.structure();
  const RigidPieces& pieces = s.rigid;
  const auto count = static_cast<std::size_t>(pieces.pieces);
  work.velocity.assign(count, {});
  work.lost.assign(count, {});
  work.mass.assign(count, 0);
  for (std::size_t f = 0; f < pieces.free.size(); ++f) {
    if (!touched.empty() && touched[f] != 0) continue;
    const auto p = static_cast<std::size_t>(pieces.free[f]);
    for (std::int32_t k = pieces.member_begin[f]; k < pieces.member_begin[f + 1]; ++k) {
      const auto i = static_cast<std::size_t>(pieces.members[static_cast<std::size_t>(k)]);
      work.velocity[p] += s.mass[i] * state.velocities[i];
      work.mass[p] += s.mass[i];
    }
    work.velocity[p] = (1 / work.mass[p]) * work.velocity[p];
  }
}

void change_velocity(MechanicsState& state, std::size_t i, Vec3 by, double h) {
  state.velocities[i] += by;
  state.positions[i] += h * by;
}

}  // namespace

SlowedNodes cap_speeds(const MechanicsModel& model, const SpeedLimits& limits, std::span<const std::uint8_t> touched,
                       double h, MechanicsState& state, SpeedCapWork& work) {
  const MechanicsModel::Structure& s = model.structure();
  const RigidPieces& pieces = s.rigid;
  const auto is_fast = [&](std::size_t i) {
    if (pieces.piece[i] < 0 || s.free[i] == 0) return false;
    const double limit = limit_of(pieces, pieces.piece[i], limits);
    return dot(state.velocities[i], state.velocities[i]) > limit * limit;
  };
  SlowedNodes out;
  std::size_t first = 0;
  while (first < pieces.piece.size() && !is_fast(first)) ++first;
  if (first == pieces.piece.size()) return out;
  find_means(model, state, touched, work);
  for (std::size_t i = first; i < pieces.piece.size(); ++i) {
    if (!is_fast(i)) continue;
    const auto p = static_cast<std::size_t>(pieces.piece[i]);
    const Vec3 own = state.velocities[i] - work.velocity[p];
    const double speed = norm(own), limit = limit_of(pieces, pieces.piece[i], limits);
    if (!(speed > limit)) continue;
    ++out.count;
    out.fastest = std::max(out.fastest, speed);
    const Vec3 lost = (1 - limit / speed) * own;
    change_velocity(state, i, -lost, h);
    work.lost[p] += s.mass[i] * lost;
  }
  if (out.count == 0) return out;
  for (std::size_t f = 0; f < pieces.free.size(); ++f) {
    const auto p = static_cast<std::size_t>(pieces.free[f]);
    if (work.mass[p] == 0 || work.lost[p] == Vec3{}) continue;  // touched, or all right
    const Vec3 back = (1 / work.mass[p]) * work.lost[p];
    for (std::int32_t k = pieces.member_begin[f]; k < pieces.member_begin[f + 1]; ++k)
      change_velocity(state, static_cast<std::size_t>(pieces.members[static_cast<std::size_t>(k)]), back, h);
  }
  return out;
}

double fastest_node(const MechanicsModel& model, const MechanicsState& state) {
  const MechanicsModel::Structure& s = model.structure();
  double most = 0;
  for (std::size_t i = 0; i < s.rigid.piece.size(); ++i)
    if (s.rigid.piece[i] >= 0) most = std::max(most, dot(state.velocities[i], state.velocities[i]));
  return std::sqrt(most);
}

}  // namespace kerf
