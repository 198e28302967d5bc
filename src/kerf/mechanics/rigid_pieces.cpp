#include "kerf/mechanics/rigid_pieces.h"

#include <algorithm>
#include <cmath>

#include "kerf/base/lanes.h"
#include "kerf/base/vec.h"
#include "kerf/mechanics/block_cholesky.h"
#include "kerf/mechanics/mechanics_model.h"
#include "kerf/mechanics/step.h"
#include "kerf/mechanics/tolerances.h"
#include "kerf/mesh/union_find.h"

namespace kerf {
bool RigidPieces::is_free(std::span<const NodeId> nodes) const {
  for (const NodeId n : nodes)
    if (n.valid() && piece[n.index()] >= 0) return free_index[static_cast<std::size_t>(piece[n.index()])] >= 0;
  return false;
}

RigidPieces rigid_pieces(const MechanicsModel& model) {
  const MechanicsModel::Structure& s = model.structure();
  const std::size_t n = model.node_count();
  RigidPieces out;
  UnionFind joined(n);
  for (std::size_t e = 0; e < model.element_count(); ++e) {
    if (s.element_slot[e] < 0) continue;
    const std::array<NodeId, 8>& nodes = model.element(HexId(e)).nodes;
    for (int c = 1; c < 8; ++c) joined.join(nodes[0].value, nodes[c].value);
  }
  std::vector<std::uint8_t> held(n, 0);  // per representative, once all are joined
  const auto weight_of = [](const RowSpring& spring) {
    double sum = 0;
    for (double weight : spring.weights) sum += weight;
    return std::abs(sum);
  };
  for (std::int32_t i : s.springs) {
    const RowSpring& spring = model.springs()[i];
    for (NodeId node : spring.nodes)
      if (node.valid()) joined.join(spring.nodes[0].value, node.value);
  }
  for (std::size_t i = 0; i < s.bonds.pairs.size(); ++i)
    if (model.bond_holds(i)) joined.join(s.bonds.pairs[i].node[0], s.bonds.pairs[i].node[8]);
  for (std::int32_t i : s.springs)
    if (weight_of(model.springs()[i]) > kTieWeight) held[joined.root(model.springs()[i].nodes[0].value)] = 1;
  for (std::size_t i = 0; i < n; ++i)
    if (s.mass[i] > 0 && s.free[i] == 0) held[joined.root(static_cast<std::int32_t>(i))] = 1;

  out.piece.assign(n, -1);
  std::vector<std::int32_t> free_index(n, -1);  // per representative
  for (std::size_t i = 0; i < n; ++i) {
    if (!(s.mass[i] > 0)) continue;
    const std::int32_t root = joined.root(static_cast<std::int32_t>(i));
    if (out.piece[root] < 0) {
      if (held[root] == 0) {
        free_index[root] = static_cast<std::int32_t>(out.free.size());
        out.free.push_back(out.pieces);
      }
      out.piece[root] = out.pieces++;
    }
    out.piece[i] = out.piece[root];
  }
  std::vector<Box3> boxes(static_cast<std::size_t>(out.pieces));
  for (std::size_t i = 0; i < n; ++i)
    if (out.piece[i] >= 0) boxes[static_cast<std::size_t>(out.piece[i])].add(model.rest_positions()[i]);
  for (const Box3& box : boxes) out.size.push_back(box.diagonal());
  out.free_index.assign(static_cast<std::size_t>(out.pieces), -1);
  for (std::size_t f = 0; f < out.free.size(); ++f) out.free_index[out.free[f]] = static_cast<std::int32_t>(f);
  out.member_begin.assign(out.free.size() + 1, 0);
  if (out.free.empty()) return out;
  const auto index_of = [&](std::size_t i) {
    return s.mass[i] > 0 ? free_index[joined.root(static_cast<std::int32_t>(i))] : -1;
  };
  for (std::size_t i = 0; i < n; ++i)
    if (const std::int32_t f = index_of(i); f >= 0) ++out.member_begin[f + 1];
  for (std::size_t f = 0; f < out.free.size(); ++f) out.member_begin[f + 1] += out.member_begin[f];
  out.members.resize(static_cast<std::size_t>(out.member_begin.back()));
  std::vector<std::int32_t> next = out.member_begin;
  for (std::size_t i = 0; i < n; ++i)
    if (const std::int32_t f = index_of(i); f >= 0) out.members[next[f]++] = static_cast<std::int32_t>(i);
  return out;
}

void absorb_rigid_momentum(const MechanicsModel& model, StepWorkspace& w) {
  const RigidPieces& p = model.structure().rigid;
  for (std::size_t f = 0; f < p.free.size(); ++f) {
    if (w.contact.set != nullptr && w.contact.touched_free[f] != 0) continue;
    const std::int32_t begin = p.member_begin[f], end = p.member_begin[f + 1];
    Lanes weighted = all_lanes(0);
    double mass = 0;
    for (std::int32_t k = begin; k < end; ++k) {
      const std::int32_t node = p.members[k];
      weighted += w.mass_diagonal[node] * load_lanes(w.position[node].v);
      mass += w.mass_diagonal[node];
    }
    const Lanes centre = weighted / mass;
    // About the centre of mass translation and rotation part: 3 x 3 inertia, momentum and angular momentum.
    double inertia[6] = {};  // xx yy zz xy yz zx of sum m q q'
    Lanes momentum = all_lanes(0), angular = all_lanes(0);
    for (std::int32_t k = begin; k < end; ++k) {
      const std::int32_t node = p.members[k];
      const Lanes q = load_lanes(w.position[node].v) - centre, r = load_lanes(w.residual[node].v);
      const double m = w.mass_diagonal[node];
      inertia[0] += m * q[0] * q[0];
      inertia[1] += m * q[1] * q[1];
      inertia[2] += m * q[2] * q[2];
      inertia[3] += m * q[0] * q[1];
      inertia[4] += m * q[1] * q[2];
      inertia[5] += m * q[2] * q[0];
      momentum += r;
      angular += cross_lanes(q, r);
    }
    const double scale = inertia[0] + inertia[1] + inertia[2];
    double block[kBlockDoubles] = {}, x[kBlockRow] = {};
    for (int i = 0; i < 3; ++i) block[8 * i + i] = 1;
    if (scale > 0) {
      const double xx = inertia[0] / scale, yy = inertia[1] / scale, zz = inertia[2] / scale;
      block[8 * 3 + 3] = yy + zz;
      block[8 * 4 + 4] = xx + zz;
      block[8 * 5 + 5] = xx + yy;
      block[8 * 3 + 4] = block[8 * 4 + 3] = -inertia[3] / scale;
      block[8 * 4 + 5] = block[8 * 5 + 4] = -inertia[4] / scale;
      block[8 * 3 + 5] = block[8 * 5 + 3] = -inertia[5] / scale;
      for (int a = 0; a < 3; ++a) x[3 + a] = angular[a] / scale;
    }
    factor_block(block);
    solve_block(block, x);
    const Lanes velocity = momentum / mass, spin = {x[3], x[4], x[5], 0};
    for (std::int32_t k = begin; k < end; ++k) {
      const std::int32_t node = p.members[k];
      const Lanes v = velocity + cross_lanes(spin, load_lanes(w.position[node].v) - centre);
      store_lanes(w.solution[node].v, load_lanes(w.solution[node].v) + v);
      store_lanes(w.residual[node].v, load_lanes(w.residual[node].v) - w.mass_diagonal[node] * v);
    }
  }
}

void carry_crumbs(const MechanicsModel& model, StepWorkspace& w) {
  const MechanicsModel::Structure& s = model.structure();
  const RigidPieces& p = s.rigid;
  // The heaviest full cell of each kind.
  std::vector<double>& full = w.cell_mass;
  full.assign(model.cells().size(), 0);
  for (std::int32_t m = 0; m < static_cast<std::int32_t>(model.materials().size()); ++m) {
    const Vec3 size = model.cell(m).size;
    double& mass = full[model.cell_of(m)];
    mass = std::max(mass, model.materials()[m].density * size.x * size.y * size.z);
  }
  for (std::size_t f = 0; f < p.free.size(); ++f) {
    const std::int32_t slot = s.slots[s.slot_begin[p.members[p.member_begin[f]]]];
    const std::int32_t cell = s.batches[static_cast<std::size_t>(slot) / (8 * MechanicsModel::kLanes)].cell;
    const double light = std::min(kCrumb * full[cell], kCrumbShare * s.total_mass);
    Lanes momentum = all_lanes(0);
    double mass = 0;
    for (std::int32_t k = p.member_begin[f]; k < p.member_begin[f + 1] && mass < light; ++k) {
      const std::int32_t node = p.members[k];
      momentum += s.mass[node] * load_lanes(w.solution[node].v);
      mass += s.mass[node];
    }
    if (!(mass > 0) || mass >= light) continue;
    for (std::int32_t k = p.member_begin[f]; k < p.member_begin[f + 1]; ++k)
      store_lanes(w.solution[p.members[k]].v, momentum / mass);
  }
}

}  // namespace kerf
