#include "kerf/session/cut_balance.h"

#include <algorithm>
#include <cmath>

namespace kerf {
namespace {

/// Of the motion of the changed nodes: differences that are only rounding.
constexpr double kBalanced = 1e-13;

void add(const MechanicsModel& model, const MechanicsState& state, HexId id, double sign, CutBalance& balance) {
  if (!model.has_element(id)) return;
  const auto& nodes = model.element(id).nodes;
  const auto& masses = model.element_masses(id);
  for (std::size_t c = 0; c < 8; ++c) {
    const Vec3 v = state.velocities[nodes[c].index()];
    balance.momentum += sign * masses[c] * v;
    balance.kinetic += sign * 0.5 * masses[c] * dot(v, v);
    balance.nodes.push_back(nodes[c]);
  }
}

/// Calls f(copy, mass) for the elements around a node.
template <class Fn>
void for_each_share(const HexMesh& hex, const MechanicsModel& model, NodeId n, Fn&& f) {
  const LatticeIndex q = hex.corner[n];
  for (int k = 0; k < 8; ++k) {
    const LatticeIndex c{q[0] - (k & 1), q[1] - (k >> 1 & 1), q[2] - (k >> 2 & 1)};
    if (!hex.contains(c)) continue;
    for (HexId h = hex.first_copy[hex.cell_id(c)]; h.valid(); h = hex.next_in_cell[h])
      if (hex.nodes[h][static_cast<std::size_t>(k)] == n && model.has_element(h))
        f(h, model.element_masses(h)[static_cast<std::size_t>(k)]);
  }
}

}  // namespace

void CutBalance::clear() {
  momentum = {};
  kinetic = 0;
  nodes.clear();
}

void leave_balance(const MechanicsModel& model, const MechanicsState& state, HexId id, CutBalance& balance) {
  add(model, state, id, -1, balance);
}

void join_balance(const MechanicsModel& model, const MechanicsState& state, HexId id, CutBalance& balance) {
  add(model, state, id, 1, balance);
}

void move_in_balance(const HexMesh& hex, const MechanicsModel& model, const MechanicsState& state,
                     std::span<const NodeMotion> old, std::span<const HexId> changed, CutBalance& balance) {
  for (std::size_t i = 0; i < old.size(); ++i) {
    const NodeMotion& m = old[i];
    const auto earlier = old.first(i);  // a node may have been moved twice: the first entry has what it had before
    if (std::any_of(earlier.begin(), earlier.end(), [&](const NodeMotion& e) { return e.node == m.node; })) continue;
    const Vec3 v = state.velocities[m.node.index()];
    if (v == m.velocity && state.positions[m.node.index()] == m.position) continue;
    for_each_share(hex, model, m.node, [&](HexId h, double mass) {
      if (std::binary_search(changed.begin(), changed.end(), h)) return;
      balance.momentum += mass * (v - m.velocity);
      balance.kinetic += 0.5 * mass * (dot(v, v) - dot(m.velocity, m.velocity));
    });
    balance.nodes.push_back(m.node);
  }
}

bool out_of_balance(const HexMesh& hex, const MechanicsModel& model, const MechanicsState& state, CutBalance& balance) {
  auto& nodes = balance.nodes;
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  balance.masses.clear();
  double mass = 0, kinetic = 0;
  std::size_t kept = 0;
  for (const NodeId n : nodes) {
    if (!hex.corner.contains(n) || !hex.active(n) || model.is_fixed(n)) continue;
    double m = 0;
    for_each_share(hex, model, n, [&](HexId, double share) { m += share; });
    if (!(m > 0)) continue;
    nodes[kept++] = n;
    balance.masses.push_back(m);
    mass += m;
    kinetic += 0.5 * m * dot(state.velocities[n.index()], state.velocities[n.index()]);
  }
  nodes.resize(kept);
  return balance.kinetic > kBalanced * kinetic || norm(balance.momentum) > kBalanced * std::sqrt(2 * mass * kinetic);
}

void settle_balance(CutBalance& balance, MechanicsState& state, NodeFade& fade) {
  double mass = 0, kinetic = 0;
  Vec3 momentum;
  for (std::size_t i = 0; i < balance.nodes.size(); ++i) {
    const double m = balance.masses[i];
    const Vec3 v = state.velocities[balance.nodes[i].index()];
    mass += m;
    momentum += m * v;
    kinetic += 0.5 * m * dot(v, v);
  }
  if (!(mass > 0)) return;
  Vec3 mean = (1 / mass) * (momentum - balance.momentum);
  const Vec3 before = (1 / mass) * momentum;
  const double own = kinetic - 0.5 * mass * dot(before, before);  // of the motion about the mean
  const double allowed = std::max(kinetic - balance.kinetic, 0.0), of_mean = 0.5 * mass * dot(mean, mean);
  double scale = 1;
  if (of_mean > allowed) {  // beside supports, which take up momentum
    scale = 0;
    mean = std::sqrt(allowed / of_mean) * mean;
  } else if (allowed - of_mean < own) {
    scale = std::sqrt((allowed - of_mean) / own);
  }
  for (const NodeId n : balance.nodes) {
    Vec3& v = state.velocities[n.index()];
    const Vec3 settled = mean + scale * (v - before);
    fade.set(n, fade.offset_of(n), fade.velocity_of(n) + (v - settled));
    v = settled;
  }
}

}  // namespace kerf
