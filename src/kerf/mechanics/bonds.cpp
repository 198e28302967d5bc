#include "kerf/mechanics/bonds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kerf/base/hash.h"
#include "kerf/base/lanes.h"
#include "kerf/mechanics/step.h"

namespace kerf {
namespace {

constexpr std::size_t kNodes = 16, kMatrix = kBondSide * kBondSide;

using Quad = StepWorkspace::Quad;

/// Of a cell's axes, the one across a bond last.
std::array<std::int8_t, 3> axes_along(const ElementCell& cell, Vec3 normal) {
  std::int8_t across = 0;
  for (std::int8_t a = 1; a < 3; ++a)
    if (std::abs(dot(cell.axes.c[static_cast<std::size_t>(a)], normal)) >
        std::abs(dot(cell.axes.c[static_cast<std::size_t>(across)], normal)))
      across = a;
  return {static_cast<std::int8_t>((across + 1) % 3), static_cast<std::int8_t>((across + 2) % 3), across};
}

/// Of a cell that bends, how far a place is off the trilinear surface, over the bending that its corners show (`bubble_of`). Exact for QM6: a shear
/// strain that is linear along the cell is what the incompatible mode takes away.
double bubble_weight(Vec3 size, Vec3 local, int along, int across) {
  return size[along] / (2 * size[across]) * (1 - local[along] * local[along]);
}

BondRow row_of(const MechanicsModel& model, const BondPoint& point, const BondPair& pair) {
  BondRow row{};
  for (std::size_t side = 0; side < 2; ++side) {
    const double sign = side == 0 ? -1 : 1;
    const Vec3 at = point.local[side];
    for (std::size_t c = 0; c < 8; ++c) {
      double weight = 0.125 * sign;
      for (int a = 0; a < 3; ++a) weight *= 1 + static_cast<double>(corner_sign(static_cast<int>(c), a)) * at[a];
      row[8 * side + c] = weight;
    }
    if (model.formulation() == ElementFormulation::kPlain) continue;
    const Vec3 size = model.cell(model.element(point.element[side]).material).size;
    for (std::size_t k = 0; k < 2; ++k)
      row[kNodes + 2 * side + k] = sign * bubble_weight(size, at, pair.axis[side][k], pair.axis[side][2]);
  }
  return row;
}

void assemble(const MechanicsModel& model, const BondPair& pair, std::size_t at, BondWork& work) {
  const BondStructure& s = model.structure().bonds;
  double* a = work.matrix.data() + kMatrix * at;
  std::fill(a, a + kMatrix, 0.0);
  double sum = 0;
  for (std::int32_t k = pair.first; k < pair.first + pair.count; ++k) {
    const auto p = static_cast<std::size_t>(s.order[static_cast<std::size_t>(k)]);
    const BondPoint& point = model.bond_points()[p];
    const double stiffness =
        (1 - work.damage[p]) * model.bond_laws()[static_cast<std::size_t>(point.law)].stiffness * point.area;
    if (!(stiffness > 0)) continue;
    sum += stiffness;
    const BondRow& w = s.rows[static_cast<std::size_t>(k)];
    for (std::size_t i = 0; i < kBondSide; ++i) {
      const double x = stiffness * w[i];
      for (std::size_t j = 0; j < kBondSide; j += 4)
        store_lanes(a + kBondSide * i + j, load_lanes(a + kBondSide * i + j) + x * load_lanes(w.data() + j));
    }
  }
  work.stiffness[at] = sum;
}

/// Puts pairs together whose damage is not what it was.
void follow_damage(const MechanicsModel& model, BondWork& work) {
  const BondStructure& s = model.structure().bonds;
  for (std::size_t i = 0; i < s.pairs.size(); ++i) {
    const BondPair& pair = s.pairs[i];
    bool same = true;
    for (std::int32_t k = pair.first; k < pair.first + pair.count; ++k) {
      const double now = work.damage[static_cast<std::size_t>(s.order[static_cast<std::size_t>(k)])];
      same = same && work.assembled[static_cast<std::size_t>(k)] == now;
      work.assembled[static_cast<std::size_t>(k)] = now;
    }
    if (!same) assemble(model, pair, i, work);
  }
}

/// out = A x for 20 vectors.
void multiply(const double* a, const Lanes (&x)[kBondSide], Lanes (&out)[kBondSide]) {
  for (std::size_t i = 0; i < kBondSide; ++i) {
    Lanes even = all_lanes(0), odd = all_lanes(0);
    for (std::size_t j = 0; j < kBondSide; j += 2) {
      even += a[kBondSide * i + j] * x[j];
      odd += a[kBondSide * i + j + 1] * x[j + 1];
    }
    out[i] = even + odd;
  }
}

double sum_of(const Lanes& v) { return (v[0] + v[1]) + v[2]; }

/// Sign of a corner in the bending along an axis.
double bend_sign(const BondPair& pair, std::size_t side, std::size_t k, std::size_t corner) {
  return 0.125 * static_cast<double>(corner_sign(static_cast<int>(corner), pair.axis[side][k]) *
                                     corner_sign(static_cast<int>(corner), pair.axis[side][2]));
}

/// Bubbles from the nodes that are there.
void bend(const BondPair& pair, const BondWork::Frame& frame, Lanes (&x)[kBondSide]) {
  for (std::size_t side = 0; side < 2; ++side)
    for (std::size_t k = 0; k < 2; ++k) {
      Lanes sum = all_lanes(0);
      for (std::size_t c = 0; c < 8; ++c) sum += bend_sign(pair, side, k, c) * x[8 * side + c];
      x[kNodes + 2 * side + k] = sum_of(sum * load_lanes(frame.axis[side][k])) * load_lanes(frame.axis[side][2]);
    }
}

/// The transpose: what bubbles feel goes to the nodes.
void unbend(const BondPair& pair, const BondWork::Frame& frame, Lanes (&force)[kBondSide]) {
  for (std::size_t side = 0; side < 2; ++side)
    for (std::size_t k = 0; k < 2; ++k) {
      const Lanes f =
          sum_of(force[kNodes + 2 * side + k] * load_lanes(frame.axis[side][2])) * load_lanes(frame.axis[side][k]);
      for (std::size_t c = 0; c < 8; ++c) force[8 * side + c] += bend_sign(pair, side, k, c) * f;
    }
}

void gather(const BondPair& pair, const BondWork::Frame& frame, const double* quads, Lanes (&x)[kBondSide]) {
  for (std::size_t c = 0; c < kNodes; ++c) x[c] = load_lanes(quads + 4 * static_cast<std::size_t>(pair.node[c]));
  bend(pair, frame, x);
}

void set_frames(const MechanicsModel& model, StepWorkspace& w) {
  const MechanicsModel::Structure& s = model.structure();
  w.bonds.frame.resize(s.bonds.pairs.size());
  for (std::size_t i = 0; i < s.bonds.pairs.size(); ++i) {
    const BondPair& pair = s.bonds.pairs[i];
    for (std::size_t side = 0; side < 2; ++side) {
      const auto slot = static_cast<std::size_t>(s.element_slot[pair.element[side].index()]) / 8;
      const std::size_t batch = slot / MechanicsModel::kLanes, lane = slot % MechanicsModel::kLanes;
      for (std::size_t k = 0; k < 3; ++k) {
        const auto column = static_cast<std::size_t>(pair.axis[side][k]);
        for (std::size_t a = 0; a < 3; ++a)
          w.bonds.frame[i].axis[side][k][a] = w.rotation[9 * batch + 3 * a + column].v[lane];
        w.bonds.frame[i].axis[side][k][3] = 0;
      }
    }
  }
}

std::size_t first_slot(const MechanicsModel::Structure& s) { return s.element_slots + 8 * s.springs.size(); }

/// Where a direction at rest in an element has turned to.
Vec3 turned(const MechanicsModel& model, const StepWorkspace& w, HexId element, Vec3 direction) {
  const auto slot = static_cast<std::size_t>(model.structure().element_slot[element.index()]) / 8;
  const std::size_t batch = slot / MechanicsModel::kLanes, lane = slot % MechanicsModel::kLanes;
  Mat3 r;
  for (std::size_t i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) r.c[i][j] = w.rotation[9 * batch + 3 * static_cast<std::size_t>(j) + i].v[lane];
  const ElementCell& cell = model.cells()[static_cast<std::size_t>(model.structure().batches[batch].cell)];
  return r * transposed_times(cell.axes, direction);
}

/// Without what bends between nodes.
Vec3 gap_of(const MechanicsModel& model, const MechanicsState& state, const BondPoint& point) {
  Vec3 gap;
  for (std::size_t side = 0; side < 2; ++side)
    for (std::size_t c = 0; c < 8; ++c) {
      double weight = side == 0 ? -0.125 : 0.125;
      for (int a = 0; a < 3; ++a)
        weight *= 1 + static_cast<double>(corner_sign(static_cast<int>(c), a)) * point.local[side][a];
      gap += weight * state.positions[model.element(point.element[side]).nodes[c].index()];
    }
  return gap;
}

struct Gap {
  double opening = 0, slip = 0;
};

Gap gap_along(Vec3 gap, Vec3 normal) {
  const double along = dot(gap, normal);
  return {std::max(along, 0.0), norm(gap - along * normal)};
}

/// The least distance at which damage of any mix begins.
double least_onset(const BondLaw& law) { return std::min(law.strength[0], law.strength[1]) / law.stiffness; }

struct Onset {
  double begins = 0, ends = 0;  // m
};

// Equations 24 to 27 of Turon et al.; with one stiffness the share of shear is that of the energies.
Onset onset(const BondLaw& law, double shear_share) {
  const double mix = std::pow(shear_share, law.mixing);
  const double n0 = law.strength[0] / law.stiffness, s0 = law.strength[1] / law.stiffness;
  const double nf = 2 * law.toughness[0] / law.strength[0], sf = 2 * law.toughness[1] / law.strength[1];
  const double begins = std::sqrt(n0 * n0 + (s0 * s0 - n0 * n0) * mix);
  return {begins, (n0 * nf + (s0 * sf - n0 * nf) * mix) / begins};
}

double share_of_shear(double opening, double slip) {
  const double all = opening * opening + slip * slip;
  return all > 0 ? slip * slip / all : 0;
}

/// J/m^2 that damage has taken: the area under the curve up to where it stands, less what is stored there.
double taken(const BondLaw& law, const Onset& at, double damage) {
  const double apart = at.begins * at.ends / (at.ends - damage * (at.ends - at.begins));
  return 0.5 * law.stiffness * at.begins * apart * damage;
}

}  // namespace

Status validate(const BondLaw& law) {
  if (!(law.stiffness > 0) || !std::isfinite(law.stiffness))
    return bad_input(fmt::format("bond: stiffness {} Pa/m must be positive", law.stiffness));
  if (!(law.mixing > 0) || !std::isfinite(law.mixing))
    return bad_input(fmt::format("bond: mixing {} must be positive", law.mixing));
  for (std::size_t i = 0; i < 2; ++i) {
    if (!(law.strength[i] > 0) || !std::isfinite(law.strength[i]))
      return bad_input(fmt::format("bond: strength {} Pa must be positive", law.strength[i]));
    const double least = law.strength[i] * law.strength[i] / (2 * law.stiffness);
    if (!(law.toughness[i] > least) || !std::isfinite(law.toughness[i]))
      return bad_input(fmt::format(
          "bond: toughness {} J/m2 must be more than {:.4g}, which its strength of {} Pa takes at a stiffness of {} Pa/m",
          law.toughness[i], least, law.strength[i], law.stiffness));
  }
  return {};
}

double resolved_strength(double young, double thickness, double toughness, double cell) {
  const double zone = kTearingCells * cell;
  return std::sqrt(young * toughness * thickness * thickness * thickness) / (zone * zone);
}

double bond_damage(const BondLaw& law, double opening, double slip) {
  const double apart = std::sqrt(opening * opening + slip * slip);
  if (apart <= least_onset(law)) return 0;
  const Onset at = onset(law, share_of_shear(opening, slip));
  if (apart <= at.begins) return 0;
  if (apart >= at.ends) return 1;
  return std::min(1.0, at.ends * (apart - at.begins) / (apart * (at.ends - at.begins)));
}

BondStructure bond_structure(const MechanicsModel& model) {
  BondStructure out;
  const std::span<const BondPoint> points = model.bond_points();
  for (std::size_t p = 0; p < points.size(); ++p)
    if (model.has_element(points[p].element[0]) && model.has_element(points[p].element[1]))
      out.order.push_back(static_cast<std::int32_t>(p));
  std::stable_sort(out.order.begin(), out.order.end(), [&](std::int32_t a, std::int32_t b) {
    return points[static_cast<std::size_t>(a)].element < points[static_cast<std::size_t>(b)].element;
  });
  for (std::size_t k = 0; k < out.order.size(); ++k) {
    const BondPoint& point = points[static_cast<std::size_t>(out.order[k])];
    if (out.pairs.empty() || out.pairs.back().element != point.element) {
      BondPair pair;
      pair.element = point.element;
      for (std::size_t side = 0; side < 2; ++side)
        for (std::size_t c = 0; c < 8; ++c) pair.node[8 * side + c] = model.element(point.element[side]).nodes[c].value;
      for (std::size_t side = 0; side < 2; ++side)
        pair.axis[side] = axes_along(model.cell(model.element(point.element[side]).material), point.normal);
      pair.first = static_cast<std::int32_t>(k);
      out.pairs.push_back(pair);
    }
    ++out.pairs.back().count;
    out.rows.push_back(row_of(model, point, out.pairs.back()));
  }
  Hash hash;
  hash.add(out.order);
  hash.add(out.rows);
  for (const std::int32_t p : out.order) {
    const BondPoint& point = points[static_cast<std::size_t>(p)];
    hash.add(point.element);
    hash.add(model.bond_laws()[static_cast<std::size_t>(point.law)].stiffness * point.area);
  }
  out.version = hash.value();
  return out;
}

void begin_bonds(const MechanicsModel& model, const MechanicsState& state, StepWorkspace& w) {
  const BondStructure& s = model.structure().bonds;
  BondWork& work = w.bonds;
  work.damage = state.bond_damage;
  work.broken = 0;
  work.dissipated = state.bond_dissipated;
  if (work.version != s.version || work.assembled.size() != s.order.size()) {
    work.version = s.version;
    work.assembled.assign(s.order.size(), -1);
    work.matrix.assign(kMatrix * s.pairs.size(), 0.0);
    work.stiffness.assign(s.pairs.size(), 0.0);
  }
  set_frames(model, w);
  follow_damage(model, work);
}

void bond_force_pass(const MechanicsModel& model, StepWorkspace& w) {
  const MechanicsModel::Structure& s = model.structure();
  Lanes x[kBondSide], force[kBondSide];
  for (std::size_t i = 0; i < s.bonds.pairs.size(); ++i) {
    double* out = w.slot[first_slot(s) + kNodes * i].v;
    if (w.bonds.stiffness[i] > 0) {
      gather(s.bonds.pairs[i], w.bonds.frame[i], w.position.data()->v, x);
      multiply(w.bonds.matrix.data() + kMatrix * i, x, force);
      unbend(s.bonds.pairs[i], w.bonds.frame[i], force);
    } else {
      std::fill(std::begin(force), std::end(force), all_lanes(0));
    }
    for (std::size_t c = 0; c < kNodes; ++c) store_lanes(out + 4 * c, -force[c]);
  }
}

void bond_stiffness_pass(const MechanicsModel& model, StepWorkspace& w, const double* p, double dt) {
  const MechanicsModel::Structure& s = model.structure();
  Lanes x[kBondSide], force[kBondSide];
  for (std::size_t i = 0; i < s.bonds.pairs.size(); ++i) {
    double* out = w.slot[first_slot(s) + kNodes * i].v;
    if (w.bonds.stiffness[i] > 0) {
      gather(s.bonds.pairs[i], w.bonds.frame[i], p, x);
      multiply(w.bonds.matrix.data() + kMatrix * i, x, force);
      unbend(s.bonds.pairs[i], w.bonds.frame[i], force);
    } else {
      std::fill(std::begin(force), std::end(force), all_lanes(0));
    }
    for (std::size_t c = 0; c < kNodes; ++c) store_lanes(out + 4 * c, (dt * dt) * force[c]);
  }
}

double add_bond_products(const MechanicsModel& model, StepWorkspace& w, double dt) {
  const BondStructure& s = model.structure().bonds;
  Lanes x[kBondSide], force[kBondSide], sum = all_lanes(0);
  for (std::size_t i = 0; i < s.pairs.size(); ++i) {
    if (!(w.bonds.stiffness[i] > 0)) continue;
    gather(s.pairs[i], w.bonds.frame[i], w.search.data()->v, x);
    multiply(w.bonds.matrix.data() + kMatrix * i, x, force);
    unbend(s.pairs[i], w.bonds.frame[i], force);
    for (std::size_t c = 0; c < kNodes; ++c) {
      const Lanes f = (dt * dt) * force[c];
      double* out = w.product[static_cast<std::size_t>(s.pairs[i].node[c])].v;
      store_lanes(out, load_lanes(out) + f);
      sum += x[c] * f;
    }
  }
  return sum_of(sum);
}

std::array<double, 9> bond_block(const MechanicsModel& model, const StepWorkspace& w, std::size_t pair, std::size_t row,
                                 std::size_t column, double dt) {
  std::array<double, 9> out{};
  for (std::size_t a = 0; a < 3; ++a) {
    Lanes x[kBondSide], force[kBondSide];
    std::fill(std::begin(x), std::end(x), all_lanes(0));
    x[column][static_cast<int>(a)] = 1;
    bend(model.structure().bonds.pairs[pair], w.bonds.frame[pair], x);
    multiply(w.bonds.matrix.data() + kMatrix * pair, x, force);
    unbend(model.structure().bonds.pairs[pair], w.bonds.frame[pair], force);
    for (std::size_t b = 0; b < 3; ++b) out[3 * b + a] = dt * dt * force[row][static_cast<int>(b)];
  }
  return out;
}

double bond_diagonal(const StepWorkspace& w, std::size_t pair, std::size_t corner, double dt) {
  const double* a = w.bonds.matrix.data() + kMatrix * pair;
  return dt * dt * a[(kBondSide + 1) * corner];
}

std::array<double, 16> middle_of_bonds(const StepWorkspace& w, std::size_t pair) {
  const double* a = w.bonds.matrix.data() + kMatrix * pair;
  std::array<double, 16> out;
  for (std::size_t i = 0; i < kNodes; ++i) {
    double sum = 0;  // the weights of a side add up to one
    for (std::size_t j = 8; j < kNodes; ++j) sum += a[kBondSide * i + j];
    out[i] = sum / w.bonds.stiffness[pair];
  }
  return out;
}

double grow_bond_damage(const MechanicsModel& model, StepWorkspace& w, double dt) {
  const MechanicsModel::Structure& s = model.structure();
  BondWork& work = w.bonds;
  Lanes x0[kBondSide], x1[kBondSide];
  double old[kMatrix], change[kMatrix];
  Lanes force[kBondSide];
  double square = 0;
  for (std::size_t i = 0; i < s.bonds.pairs.size(); ++i) {
    if (!(work.stiffness[i] > 0)) continue;
    const BondPair& pair = s.bonds.pairs[i];
    gather(pair, work.frame[i], w.position.data()->v, x0);
    gather(pair, work.frame[i], w.solution.data()->v, x1);
    for (std::size_t c = 0; c < kBondSide; ++c) x1[c] = x0[c] + dt * x1[c];
    bool grew = false;
    for (std::int32_t k = pair.first; k < pair.first + pair.count; ++k) {
      const auto p = static_cast<std::size_t>(s.bonds.order[static_cast<std::size_t>(k)]);
      if (!(work.damage[p] < 1)) continue;
      const BondPoint& point = model.bond_points()[p];
      const BondLaw& law = model.bond_laws()[static_cast<std::size_t>(point.law)];
      const BondRow& weight = s.bonds.rows[static_cast<std::size_t>(k)];
      Lanes gap = all_lanes(0);
      for (std::size_t c = 0; c < kBondSide; ++c) gap += weight[c] * x1[c];
      const Vec3 g{gap[0], gap[1], gap[2]};
      if (!(norm(g) > least_onset(law))) continue;
      const Vec3 along =
          turned(model, w, pair.element[0], point.normal) + turned(model, w, pair.element[1], point.normal);
      const Gap apart = gap_along(g, norm(along) > 0 ? normalized(along) : point.normal);
      const double now = bond_damage(law, apart.opening, apart.slip);
      if (!(now > work.damage[p])) continue;
      const Onset at = onset(law, share_of_shear(apart.opening, apart.slip));
      work.dissipated += point.area * (taken(law, at, now) - taken(law, at, work.damage[p]));
      work.damage[p] = now;
      work.broken += now >= 1 ? 1 : 0;
      grew = true;
    }
    if (!grew) continue;
    double* a = work.matrix.data() + kMatrix * i;
    std::copy(a, a + kMatrix, old);
    for (std::int32_t k = pair.first; k < pair.first + pair.count; ++k)
      work.assembled[static_cast<std::size_t>(k)] =
          work.damage[static_cast<std::size_t>(s.bonds.order[static_cast<std::size_t>(k)])];
    assemble(model, pair, i, work);
    for (std::size_t k = 0; k < kMatrix; ++k) change[k] = a[k] - old[k];
    multiply(change, x0, force);
    unbend(pair, work.frame[i], force);
    for (std::size_t c = 0; c < kNodes; ++c) {
      double* out = w.right_side[static_cast<std::size_t>(pair.node[c])].v;
      store_lanes(out, load_lanes(out) - dt * force[c]);
    }
    multiply(change, x1, force);
    unbend(pair, work.frame[i], force);
    for (std::size_t c = 0; c < kNodes; ++c) {
      const auto node = static_cast<std::size_t>(pair.node[c]);
      const Lanes f = dt * force[c];
      double* out = w.residual[node].v;
      store_lanes(out, load_lanes(out) - f);
      square += s.free[node] * ((f[0] * f[0] + f[1] * f[1]) + f[2] * f[2]);
    }
  }
  return std::sqrt(square);
}

double bond_energy(const MechanicsModel& model, const MechanicsState& state) {
  double sum = 0;
  for (std::size_t p = 0; p < model.bond_points().size(); ++p) {
    const BondPoint& point = model.bond_points()[p];
    if (!model.has_element(point.element[0]) || !model.has_element(point.element[1])) continue;
    const double k =
        (1 - state.bond_damage[p]) * model.bond_laws()[static_cast<std::size_t>(point.law)].stiffness * point.area;
    const Vec3 gap = gap_of(model, state, point);
    sum += 0.5 * k * dot(gap, gap);
  }
  return sum;
}

}  // namespace kerf
