#include "kerf/mechanics/step.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kerf/base/hash.h"
#include "kerf/base/lanes.h"
#include "kerf/base/stopwatch.h"
#include "kerf/mechanics/chunked_loop.h"
#include "kerf/mechanics/direct_solver.h"
#include "kerf/mechanics/element_pass.h"
#include "kerf/mechanics/node_block.h"
#include "kerf/mechanics/pass_length.h"
#include "kerf/mechanics/tolerances.h"

namespace kerf {
namespace {

using Quad = StepWorkspace::Quad;
using Structure = MechanicsModel::Structure;
using TurningPiece = StepWorkspace::TurningPiece;

/// Passes over contacts at most, in times of those that are wished for.
constexpr int kMostPasses = 3;
/// The least tolerance for which products may be taken in single precision, over the ratio of elastic forces to inertia.
constexpr double kSingleDigits = 1e-6;

Lanes lanes_of(Vec3 v) { return Lanes{v.x, v.y, v.z, 0}; }
Vec3 vec_of(const Quad& q) { return {q.v[0], q.v[1], q.v[2]}; }
double sum_of(const Lanes& v) { return (v[0] + v[1]) + v[2]; }

void resize(const MechanicsModel& model, StepWorkspace& w) {
  const Structure& s = model.structure();
  const std::size_t n = model.node_count();
  for (std::vector<Quad>* v : {&w.position, &w.velocity, &w.right_side, &w.solution, &w.residual, &w.search,
                               &w.preconditioned, &w.start_solution, &w.start_residual})
    v->resize(n);
  w.product.resize(s.sums);
  w.slot.resize(s.element_slots + 8 * s.springs.size() + 16 * s.bonds.pairs.size());
  w.mass_diagonal.resize(n);
  w.diagonal.resize(2 * n);
  w.inverse_diagonal.resize(3 * n);
  w.diagonal_slot.resize(2 * s.element_slots);
  w.rotation.resize(9 * s.batches.size());
  w.scaled_rotation.resize(9 * s.batches.size());
  w.tension.resize(s.batches.size());
  w.spring_scale.resize(s.springs.size());
  w.partial.resize(n / kNodeGrain + 1);
  w.inverted.resize(s.batches.size() / kBatchGrain + 1);
}

void load_state(const MechanicsModel& model, const MechanicsState& state, StepWorkspace& w) {
  for (std::size_t i = 0; i < model.node_count(); ++i) {
    store_lanes(w.position[i].v, lanes_of(state.positions[i]));
    store_lanes(w.velocity[i].v, lanes_of(state.velocities[i]));
  }
  const Structure& s = model.structure();
  for (std::size_t b = 0; b < s.batches.size(); ++b)
    for (int lane = 0; lane < MechanicsModel::kLanes; ++lane) {
      const std::int32_t e = s.batches[b].element[lane];
      const Mat3 r = e >= 0 ? state.rotations[e] : model.cells()[s.batches[b].cell].axes;
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) w.rotation[9 * b + 3 * i + j].v[lane] = r.c[j][i];
    }
}

void store_rotations(const MechanicsModel& model, const StepWorkspace& w, MechanicsState& state) {
  const Structure& s = model.structure();
  for (std::size_t b = 0; b < s.batches.size(); ++b)
    for (int lane = 0; lane < MechanicsModel::kLanes; ++lane) {
      const std::int32_t e = s.batches[b].element[lane];
      if (e < 0) continue;
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) state.rotations[e].c[j][i] = w.rotation[9 * b + 3 * i + j].v[lane];
    }
}

Lanes gathered(const Structure& s, const StepWorkspace& w, std::size_t node) {
  Lanes sum = all_lanes(0);
  for (std::int32_t i = s.slot_begin[node]; i < s.slot_begin[node + 1]; ++i) sum += load_lanes(w.slot[s.slots[i]].v);
  return sum;
}

int force_pass(const MechanicsModel& model, StepWorkspace& w, bool parallel) {
  const std::size_t n = model.structure().batches.size();
  for_each_chunk(parallel, n, kBatchGrain, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
    w.inverted[chunk] = element_force_pass(model, w, begin, end);
  });
  int inverted = 0;
  for (std::size_t c = 0; c * kBatchGrain < n; ++c) inverted += w.inverted[c];
  return inverted;
}

// Spring forces at the end of the step as far as they do not depend on the new velocity, into their slots.
void spring_force_pass(const MechanicsModel& model, StepWorkspace& w, double dt) {
  const Structure& s = model.structure();
  for (std::size_t i = 0; i < s.springs.size(); ++i) {
    const RowSpring& spring = model.springs()[s.springs[i]];
    w.spring_scale[i] = dt * dt * spring.stiffness + dt * spring.damping;
    Lanes at = all_lanes(0);
    for (int k = 0; k < 8; ++k)
      if (spring.nodes[k].valid()) at += spring.weights[k] * load_lanes(w.position[spring.nodes[k].index()].v);
    const Lanes force =
        spring.stiffness * (lanes_of(spring.target) - at) + spring.damping * lanes_of(spring.target_velocity);
    for (int k = 0; k < 8; ++k) store_lanes(w.slot[s.element_slots + 8 * i + k].v, spring.weights[k] * force);
  }
}

// Of springs that are rows.
void spring_stiffness_pass(const MechanicsModel& model, StepWorkspace& w, const std::vector<Quad>& p) {
  const Structure& s = model.structure();
  for (const std::int32_t row : s.cell_springs.rows) {
    const auto i = static_cast<std::size_t>(row);
    const RowSpring& spring = model.springs()[s.springs[i]];
    Lanes at = all_lanes(0);
    for (int k = 0; k < 8; ++k)
      if (spring.nodes[k].valid()) at += spring.weights[k] * load_lanes(p[spring.nodes[k].index()].v);
    at *= w.spring_scale[i];
    for (int k = 0; k < 8; ++k) store_lanes(w.slot[s.element_slots + 8 * i + k].v, spring.weights[k] * at);
  }
}

// M v + dt (f_ext + f_int)
void right_side_pass(const MechanicsModel& model, StepWorkspace& w, const StepOptions& o) {
  const Structure& s = model.structure();
  const Lanes gravity = lanes_of(o.gravity);
  for_each_chunk(o.parallel, model.node_count(), kNodeGrain, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      const Lanes force = s.mass[i] * gravity + lanes_of(model.loads()[i]) + gathered(s, w, i);
      store_lanes(w.right_side[i].v, s.mass[i] * load_lanes(w.velocity[i].v) + o.dt * force);
      w.mass_diagonal[i] = s.mass[i] + o.dt * s.damping_mass[i];
    }
  });
}

// Inverse 3 x 3 diagonal blocks; zero where nothing moves.
void diagonal_pass(const MechanicsModel& model, StepWorkspace& w, const StepOptions& o) {
  const Structure& s = model.structure();
  for_each_chunk(o.parallel, s.batches.size(), kBatchGrain, [&](std::size_t begin, std::size_t end, std::size_t) {
    element_scale_pass(model, w, o.dt, !(o.gravity == Vec3{}), begin, end);
    element_diagonal_pass(model, w, begin, end);
  });
  const std::size_t full_slots = s.full_batches * 32, bond_slots = s.element_slots + 8 * s.springs.size();
  for_each_chunk(o.parallel, model.node_count(), kNodeGrain, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      Quad* out = w.inverse_diagonal.data() + 3 * i;
      if (s.free[i] == 0) {
        for (int k = 0; k < 3; ++k) store_lanes(out[k].v, all_lanes(0));
        continue;
      }
      const double m = w.mass_diagonal[i];
      Lanes first = {m, m, m, 0}, second = all_lanes(0);
      for (std::int32_t k = s.slot_begin[i]; k < s.slot_begin[i + 1]; ++k) {
        const auto slot = static_cast<std::size_t>(s.slots[k]);
        if (slot < s.element_slots) {
          const Quad* in = w.diagonal_slot.data() + 2 * diagonal_slot(slot, full_slots);
          first += load_lanes(in[0].v);
          second += load_lanes(in[1].v);
        } else if (slot >= bond_slots) {
          const std::size_t bond = slot - bond_slots;
          const double x = bond_diagonal(w, bond / 16, bond % 16, o.dt);
          first += Lanes{x, x, x, 0};
        } else {
          const std::size_t spring = (slot - s.element_slots) / 8;
          if (s.cell_springs.is_row[spring] == 0) continue;  // its cell's block has it
          const double weight = model.springs()[s.springs[spring]].weights[slot & 7];
          const double x = w.spring_scale[spring] * weight * weight;
          first += Lanes{x, x, x, 0};
        }
      }
      store_lanes(w.diagonal[2 * i].v, first);
      store_lanes(w.diagonal[2 * i + 1].v, second);
      store_inverse(first, second, out[0].v);
    }
  });
}

double reduced(const StepWorkspace& w, std::size_t n, int component) {
  double sum = 0;
  for (std::size_t c = 0; c * kNodeGrain < n; ++c) sum += w.partial[c].v[component];
  return sum;
}

// product = A search by the matrix put together; springs across cells are rows.
double multiply_by_nodes(const MechanicsModel& model, StepWorkspace& w, double dt, bool parallel) {
  const Structure& s = model.structure();
  const std::size_t n = model.node_count();
  narrow_search(w);
  for_each_chunk(parallel, n, kNodeGrain, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
    w.partial[chunk].v[0] = multiply_node_matrix(model, w, begin, end);
  });
  double sum = reduced(w, n, 0);
  for (const std::int32_t i : model.node_matrix().rows) {
    const RowSpring& spring = model.springs()[s.springs[i]];
    Lanes at = all_lanes(0);
    for (int k = 0; k < 8; ++k)
      if (spring.nodes[k].valid()) at += spring.weights[k] * load_lanes(w.search[spring.nodes[k].index()].v);
    const Lanes force = w.spring_scale[i] * at;
    for (int k = 0; k < 8; ++k) {
      if (!spring.nodes[k].valid()) continue;
      double* out = w.product[spring.nodes[k].index()].v;
      store_lanes(out, load_lanes(out) + spring.weights[k] * force);
    }
    sum += sum_of(at * force);
  }
  if (!s.bonds.pairs.empty()) sum += add_bond_products(model, w, dt);
  return sum;
}

// Then no digit of momentum may be lost.
bool free_piece_touched(const StepWorkspace& w) { return w.contact.set != nullptr && w.contact.any_free_touched; }

// product = A p for all nodes and tools; returns p' A p.
double multiply(const MechanicsModel& model, StepWorkspace& w, SystemVector which, double dt, bool parallel) {
  const Structure& s = model.structure();
  const std::vector<Quad>& p = which == SystemVector::kSearch ? w.search : w.solution;
  const std::size_t n = model.node_count();
  if (w.node_matrix && which == SystemVector::kSearch && !free_piece_touched(w)) {
    const double sum = multiply_by_nodes(model, w, dt, parallel);
    return w.contact.set != nullptr ? sum + multiply_contacts(model, which, w) : sum;
  }
  for_each_chunk(parallel, s.full_batches, s.sum_grain,
                 [&](std::size_t begin, std::size_t end, std::size_t) { element_sum_pass(model, w, p, begin, end); });
  for_each_chunk(parallel, s.batches.size() - s.full_batches, kBatchGrain,
                 [&](std::size_t begin, std::size_t end, std::size_t) {
                   element_stiffness_pass(model, w, p, s.full_batches + begin, s.full_batches + end);
                 });
  spring_stiffness_pass(model, w, p);
  if (!s.bonds.pairs.empty()) bond_stiffness_pass(model, w, p.data()->v, dt);
  for_each_chunk(parallel, n, kNodeGrain, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
    Lanes dot = all_lanes(0);
    for (std::size_t i = begin; i < end; ++i) {
      const Lanes x = load_lanes(p[i].v);
      const Lanes y = w.mass_diagonal[i] * x + product_of_elements(s, w, i);
      store_lanes(w.product[i].v, y);
      dot += x * y;
    }
    w.partial[chunk].v[0] = sum_of(dot);
  });
  const double sum = reduced(w, n, 0);
  return w.contact.set != nullptr ? sum + multiply_contacts(model, which, w) : sum;
}

struct Products {
  double rz = 0;  // r' z with the block-Jacobi part of z
  double rr = 0;  // r' r over what moves
};

double square_of(const ToolWork& tool) {
  double sum = 0;
  for (int a = 0; a < 3; ++a) {
    const double turn = tool.residual[3 + a] / tool.length;
    sum += tool.residual[a] * tool.residual[a] + turn * turn;
  }
  return sum;
}

// x += alpha p, r -= alpha A p, z = D^-1 r. Held nodes keep their residual: it is what their support carries.
Products advance(const MechanicsModel& model, StepWorkspace& w, double alpha, bool parallel) {
  const Structure& s = model.structure();
  const std::size_t n = model.node_count();
  for_each_chunk(parallel, n, kNodeGrain, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
    Lanes rz = all_lanes(0), rr = all_lanes(0);
    for (std::size_t i = begin; i < end; ++i) {
      store_lanes(w.solution[i].v, load_lanes(w.solution[i].v) + alpha * load_lanes(w.search[i].v));
      const Lanes r = load_lanes(w.residual[i].v) - alpha * load_lanes(w.product[i].v);
      store_lanes(w.residual[i].v, r);
      const Quad* d = w.inverse_diagonal.data() + 3 * i;
      const Lanes z = all_lanes(r[0]) * load_lanes(d[0].v) + all_lanes(r[1]) * load_lanes(d[1].v) +
                      all_lanes(r[2]) * load_lanes(d[2].v);
      store_lanes(w.preconditioned[i].v, z);
      rz += r * z;
      rr += s.free[i] * (r * r);
    }
    w.partial[chunk].v[0] = sum_of(rz);
    w.partial[chunk].v[1] = sum_of(rr);
  });
  Products sums{reduced(w, n, 0), reduced(w, n, 1)};
  if (w.contact.set == nullptr) return sums;
  for (ToolWork& tool : w.contact.tools) {
    double z[kBlockRow] = {};
    for (int a = 0; a < 6; ++a) {
      tool.solution[a] += alpha * tool.search[a];
      tool.residual[a] -= alpha * tool.product[a];
      z[a] = tool.residual[a];
    }
    solve_block(tool.block, z);
    for (int a = 0; a < 6; ++a) {
      tool.preconditioned[a] = z[a];
      sums.rz += tool.residual[a] * z[a];
    }
    sums.rr += square_of(tool);
  }
  if (w.contact.inverse.used) sums.rz += apply_contact_inverse(w);
  return sums;
}

// A residual over all nodes does not see those of slivers, which weigh next to nothing: what it leaves undone there is a tiny force
// and a huge velocity. Is what a node of its own would still change, z = D^-1 r, small for the body's speed everywhere?
bool every_node_settled(const MechanicsModel& model, StepWorkspace& w, const StepOptions& o) {
  const std::size_t n = model.node_count();
  for_each_chunk(o.parallel, n, kNodeGrain, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
    double most = 0, energy = 0, mass = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const Lanes z = load_lanes(w.preconditioned[i].v), v = load_lanes(w.solution[i].v);
      most = std::max(most, sum_of(z * z));
      energy += w.mass_diagonal[i] * sum_of(v * v);
      mass += w.mass_diagonal[i];
    }
    w.partial[chunk] = {most, energy, mass, 0};
  });
  double most = 0;
  for (std::size_t c = 0; c * kNodeGrain < n; ++c) most = std::max(most, w.partial[c].v[0]);
  const double still = kStillAtRest * o.dt * std::max(norm(o.gravity), kFloorGravity);
  const double speed = reduced(w, n, 1) / std::max(reduced(w, n, 2), 1e-300);
  return !(most > kNodeTolerance * kNodeTolerance * speed + still * still);
}

// Momentum that a node brings into the step, with what weight and loads add.
Lanes momentum_of(const MechanicsModel& model, const StepWorkspace& w, const StepOptions& o, std::size_t node) {
  return model.structure().mass[node] * (load_lanes(w.velocity[node].v) + o.dt * lanes_of(o.gravity)) +
         o.dt * lanes_of(model.loads()[node]);
}

// Does something press on this free piece? Else it is in flight.
bool is_touched(const StepWorkspace& w, std::size_t free) {
  return w.contact.set != nullptr && w.contact.touched_free[free] != 0;
}

// A step stretches a piece in flight by half the square of the angle that it turns by. Elastic forces, to which the residual is relative, are then many times the momentum
// of its nodes about its centre, and a hundredth of them bends it anew in every step. Does the residual hold at most `share` of that momentum, or `floor` N s, in every piece
// that turns by more than kFlightTurn? What of it would turn the piece is no matter: keep_rigid_momentum takes it back.
bool flight_settled(const MechanicsModel& model, const StepWorkspace& w, double dt, double share, double floor) {
  const Structure& s = model.structure();
  const RigidPieces& p = s.rigid;
  for (std::size_t f = 0; f < p.free.size(); ++f) {
    if (is_touched(w, f)) continue;
    const std::int32_t begin = p.member_begin[f], end = p.member_begin[f + 1];
    double left = 0, mass = 0;
    Lanes momentum = all_lanes(0), moment = all_lanes(0);
    for (std::int32_t k = begin; k < end; ++k) {
      const std::int32_t node = p.members[k];
      const Lanes r = load_lanes(w.residual[node].v);
      left += sum_of(r * r);
      mass += s.mass[node];
      momentum += s.mass[node] * load_lanes(w.velocity[node].v);
      moment += s.mass[node] * load_lanes(w.position[node].v);
    }
    if (!(left > floor * floor)) continue;
    const Lanes velocity = momentum / mass, centre = moment / mass;
    double brought = 0, moves = 0, size = 0;
    for (std::int32_t k = begin; k < end; ++k) {
      const std::int32_t node = p.members[k];
      const Lanes v = load_lanes(w.velocity[node].v) - velocity, x = load_lanes(w.position[node].v) - centre;
      const Lanes own = s.mass[node] * v + dt * lanes_of(model.loads()[node]);
      brought += sum_of(own * own);
      moves += s.mass[node] * sum_of(v * v);
      size += s.mass[node] * sum_of(x * x);
    }
    const bool turns = dt * dt * moves > kFlightTurn * kFlightTurn * size;
    if (turns && left > share * share * brought) return false;
  }
  return true;
}

// Which pieces turn, and what momentum they bring. A step stretches those that are held or touched as it does what is in flight, so a residual relative to elastic forces
// says little of how they turn; but what a solve leaves undone of that, nothing gives back.
void find_turning(const MechanicsModel& model, StepWorkspace& w, const StepOptions& o) {
  const Structure& s = model.structure();
  const RigidPieces& p = s.rigid;
  w.turning.assign(static_cast<std::size_t>(p.pieces), {});
  w.any_turning = false;
  for (std::size_t i = 0; i < model.node_count(); ++i) {
    if (p.piece[i] < 0) continue;
    TurningPiece& piece = w.turning[static_cast<std::size_t>(p.piece[i])];
    piece.mass += s.mass[i];
    const Lanes m = all_lanes(s.mass[i]);
    store_lanes(piece.momentum.v, load_lanes(piece.momentum.v) + m * load_lanes(w.velocity[i].v));
    store_lanes(piece.moment.v, load_lanes(piece.moment.v) + m * load_lanes(w.position[i].v));
  }
  for (std::size_t i = 0; i < model.node_count(); ++i) {
    if (p.piece[i] < 0) continue;
    TurningPiece& piece = w.turning[static_cast<std::size_t>(p.piece[i])];
    const Lanes v = load_lanes(w.velocity[i].v) - load_lanes(piece.momentum.v) / piece.mass,
                x = load_lanes(w.position[i].v) - load_lanes(piece.moment.v) / piece.mass,
                own = momentum_of(model, w, o, i);
    piece.moves += s.mass[i] * sum_of(v * v);
    piece.size += s.mass[i] * sum_of(x * x);
    piece.brought += s.free[i] * sum_of(own * own);
  }
  for (TurningPiece& piece : w.turning) {
    piece.turns = o.dt * o.dt * piece.moves > kTurn * kTurn * piece.size;
    w.any_turning |= piece.turns;
  }
}

// Does the residual hold at most `share` of the momentum that each of these brings, or `floor` N s?
bool turning_settled(const MechanicsModel& model, StepWorkspace& w, double share, double floor) {
  if (!w.any_turning) return true;
  const Structure& s = model.structure();
  const RigidPieces& p = s.rigid;
  for (TurningPiece& piece : w.turning) piece.left = 0;
  for (std::size_t i = 0; i < model.node_count(); ++i) {
    if (p.piece[i] < 0) continue;
    const Lanes r = load_lanes(w.residual[i].v);
    w.turning[static_cast<std::size_t>(p.piece[i])].left += s.free[i] * sum_of(r * r);
  }
  for (std::size_t k = 0; k < w.turning.size(); ++k) {
    const TurningPiece& piece = w.turning[k];
    const std::int32_t free = p.free_index[k];
    const bool flies = free >= 0 && !is_touched(w, static_cast<std::size_t>(free));
    if (piece.turns && !flies && piece.left > floor * floor && piece.left > share * share * piece.brought) return false;
  }
  return true;
}

// p = z + beta p, where z gets its coarse part here: t + w x arm of the node's group.
void next_direction(const MechanicsModel& model, StepWorkspace& w, double beta, bool two_level, bool parallel) {
  const CoarseStructure& c = model.coarse();
  for_each_chunk(parallel, model.node_count(), kNodeGrain, [&](std::size_t begin, std::size_t end, std::size_t) {
    if (!two_level) {
      for (std::size_t i = begin; i < end; ++i)
        store_lanes(w.search[i].v, load_lanes(w.preconditioned[i].v) + beta * load_lanes(w.search[i].v));
      return;
    }
    for (std::size_t i = begin; i < end; ++i) {
      Lanes p = load_lanes(w.preconditioned[i].v) + beta * load_lanes(w.search[i].v);
      if (c.place[i] >= 0) {
        const double* y = w.coarse.value.data() + kBlockRow * static_cast<std::size_t>(c.place[i]);
        p += Lanes{y[0], y[1], y[2], 0} + cross_lanes(Lanes{y[3], y[4], y[5], 0}, load_lanes(w.arm[i].v));
      }
      store_lanes(w.search[i].v, p);
    }
  });
  if (w.contact.set == nullptr) return;
  for (std::size_t i = 0; i < w.contact.tools.size(); ++i) {
    ToolWork& tool = w.contact.tools[i];
    const double* y =
        two_level ? w.coarse.value.data() + kBlockRow * (static_cast<std::size_t>(c.groups) + i) : nullptr;
    for (int a = 0; a < 6; ++a)
      tool.search[a] = tool.preconditioned[a] + beta * tool.search[a] + (y != nullptr ? y[a] : 0);
  }
}

// The residual of the last pass with what contacts have changed since; search and product are cleared. Returns its norm over what moves.
double carried_residual(const MechanicsModel& model, StepWorkspace& w, bool parallel) {
  const Structure& s = model.structure();
  const std::size_t n = model.node_count();
  if (w.contact.set != nullptr) add_impulse_changes(w);
  for_each_chunk(parallel, n, kNodeGrain, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
    Lanes sum = all_lanes(0);
    for (std::size_t i = begin; i < end; ++i) {
      const Lanes r = load_lanes(w.residual[i].v);
      sum += s.free[i] * (r * r);
      store_lanes(w.search[i].v, all_lanes(0));
      store_lanes(w.product[i].v, all_lanes(0));
    }
    w.partial[chunk].v[0] = sum_of(sum);
  });
  double sum = reduced(w, n, 0);
  if (w.contact.set == nullptr) return std::sqrt(sum);
  for (ToolWork& tool : w.contact.tools) {
    for (int a = 0; a < 6; ++a) tool.search[a] = tool.product[a] = 0;
    sum += square_of(tool);
  }
  return std::sqrt(sum);
}

// residual = b - A x, or b alone; search and product are cleared. Returns its norm over what moves.
double fresh_residual(const MechanicsModel& model, StepWorkspace& w, bool x_is_zero, double dt, bool parallel) {
  const Structure& s = model.structure();
  const std::size_t n = model.node_count();
  if (!x_is_zero) multiply(model, w, SystemVector::kSolution, dt, parallel);
  const auto norm_of = [&](bool clear) {
    for_each_chunk(parallel, n, kNodeGrain, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
      Lanes bb = all_lanes(0);
      for (std::size_t i = begin; i < end; ++i) {
        Lanes r = load_lanes(clear ? w.right_side[i].v : w.residual[i].v);
        if (clear) {
          if (!x_is_zero) r -= load_lanes(w.product[i].v);
          store_lanes(w.residual[i].v, r);
          store_lanes(w.search[i].v, all_lanes(0));
          store_lanes(w.product[i].v, all_lanes(0));
        }
        bb += s.free[i] * (r * r);
      }
      w.partial[chunk].v[0] = sum_of(bb);
    });
    return reduced(w, n, 0);
  };
  double sum = norm_of(true);
  if (w.contact.set != nullptr) {
    if (w.contact.pass == 1) w.contact.unforced = std::sqrt(sum);
    for (ToolWork& tool : w.contact.tools)
      for (int a = 0; a < 6; ++a) {
        tool.residual[a] = x_is_zero ? 0 : -tool.product[a];
        tool.search[a] = tool.product[a] = 0;
      }
    add_contact_impulses(w);
    if (!w.contact.pressing.empty()) sum = norm_of(false);
    for (const ToolWork& tool : w.contact.tools) sum += square_of(tool);
  }
  return std::sqrt(sum);
}

// Norm of the right-hand side with springs as if their nodes went on at their pace. A spring that is led somewhere asks for the whole way, and most of that is taken up by
// going on as before: measured by it, a solve would leave all else undone.
double norm_at_pace(const MechanicsModel& model, StepWorkspace& w, bool parallel) {
  const Structure& s = model.structure();
  for (Quad& q : w.search) store_lanes(q.v, all_lanes(0));
  for (std::size_t i = 0; i < s.springs.size(); ++i) {
    const RowSpring& spring = model.springs()[s.springs[i]];
    Lanes at = all_lanes(0);
    for (int k = 0; k < 8; ++k)
      if (spring.nodes[k].valid()) at += spring.weights[k] * load_lanes(w.velocity[spring.nodes[k].index()].v);
    for (int k = 0; k < 8; ++k) {
      if (!spring.nodes[k].valid()) continue;
      double* sum = w.search[spring.nodes[k].index()].v;
      store_lanes(sum, load_lanes(sum) + (w.spring_scale[i] * spring.weights[k]) * at);
    }
  }
  for_each_chunk(parallel, model.node_count(), kNodeGrain, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
    Lanes sum = all_lanes(0);
    for (std::size_t i = begin; i < end; ++i) {
      const Lanes b = load_lanes(w.right_side[i].v) - load_lanes(w.search[i].v);
      sum += s.free[i] * (b * b);
    }
    w.partial[chunk].v[0] = sum_of(sum);
  });
  return std::sqrt(reduced(w, model.node_count(), 0));
}

// Starts from zero; held nodes from their prescribed velocity, free pieces and free tools from their rigid motion.
// Returns the norm of the residual, which for a body that rests on something is the right-hand side.
double start_solve(const MechanicsModel& model, StepWorkspace& w, double dt, bool parallel) {
  const Structure& s = model.structure();
  const std::size_t n = model.node_count();
  bool nonzero = !s.rigid.free.empty();
  for (std::size_t i = 0; i < n; ++i) {
    const bool held = model.is_fixed(NodeId(i));
    const Vec3 v = held ? model.prescribed_velocities()[i] : Vec3{};
    nonzero = nonzero || !(v == Vec3{});
    store_lanes(w.solution[i].v, lanes_of(v));
  }
  if (w.contact.set != nullptr)
    for (ToolWork& tool : w.contact.tools) {
      nonzero = nonzero || !tool.touched;
      for (int a = 0; a < 6; ++a)
        tool.solution[a] = tool.touched ? 0 : tool.right[a] / (a < 3 ? tool.mass : tool.inertia);
    }
  if (!s.rigid.free.empty()) {
    w.residual = w.right_side;
    absorb_rigid_momentum(model, w);
  }
  return fresh_residual(model, w, !nonzero, dt, parallel);
}

// Elastic forces turn no piece as a whole; linearised with frozen rotations they do, a little, where it spins. A piece in flight gets the momentum and the angular momentum
// that its nodes bring along, less what damping takes. The residual of its nodes is used up.
void keep_rigid_momentum(const MechanicsModel& model, StepWorkspace& w, const StepOptions& o) {
  const RigidPieces& p = model.structure().rigid;
  for (std::size_t f = 0; f < p.free.size(); ++f) {
    if (is_touched(w, f)) continue;
    for (std::int32_t k = p.member_begin[f]; k < p.member_begin[f + 1]; ++k) {
      const std::int32_t node = p.members[k];
      store_lanes(w.residual[node].v,
                  momentum_of(model, w, o, node) - w.mass_diagonal[node] * load_lanes(w.solution[node].v));
    }
  }
  absorb_rigid_momentum(model, w);
}

// E dt^2 / (rho h^2): elastic forces over inertia in a step.
double stiffness_ratio(const MechanicsModel& model, const StepOptions& o) {
  double ratio = 0;
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(model.materials().size()); ++i) {
    const Material& m = model.materials()[i];
    const Vec3 cell = model.cell(i).size;
    const double h = std::min({cell.x, cell.y, cell.z});
    ratio = std::max(ratio, m.young * o.dt * o.dt / (m.density * h * h));
  }
  return ratio;
}

// Is the matrix put together cheaper than products cell by cell, where there will be many, and has it digits enough?
bool gains_by_node_matrix(const MechanicsModel& model, const StepOptions& o) {
  const Structure& s = model.structure();
  const double ratio = stiffness_ratio(model, o);
  return model.node_count() <= kMostMatrixNodes && 2 * s.full_batches <= s.batches.size() && ratio <= kStiffestMatrix &&
         o.tolerance >= kSingleDigits * std::max(1.0, ratio);
}

bool is_stiff(const MechanicsModel& model, const StepOptions& o) {
  return stiffness_ratio(model, o) > kStiffByMomentum;
}

// Are iterations that come to no end worth the time that the matrix takes to be factorised?
bool may_factorise(const MechanicsModel& model, const StepOptions& o) {
  return o.solver == SolverKind::kConjugateGradients && model.node_count() <= kMostFactorisedNodes;
}

// Norm of the momentum that the nodes bring into the step and of what weight and loads add, node by node.
double momentum_brought(const MechanicsModel& model, const StepWorkspace& w, const StepOptions& o) {
  const Structure& s = model.structure();
  double sum = 0;
  for (std::size_t i = 0; i < model.node_count(); ++i) {
    const Lanes p = momentum_of(model, w, o, i);
    sum += s.free[i] * sum_of(p * p);
  }
  return std::sqrt(sum);
}

// One number for a list; two lists with the same one would only cost iterations.
std::uint64_t name_of(const std::vector<std::int32_t>& list) {
  Hash hash;
  hash.add(list);
  return hash.value();
}

/// How a step is solved.
enum class Attempt {
  kAsAsked,   ///< as the options say; iterations that hit their cap are taken for what they are
  kUntilCap,  ///< the same, but given up at the cap
  kDirectly,  ///< factorised, whatever the options say, as exactly as iterations would be
};

// The linear solves of one step: one without contacts, several while these open and close.
struct Solver {
  MechanicsModel& model;
  StepWorkspace& w;
  const StepOptions& o;
  std::int32_t& two_level_steps;
  StepReport& report;
  Attempt attempt;
  double floor = 0, norm_b = 0;
  double at_pace = HUGE_VAL;  // N s: norm_at_pace(), where there are springs
  bool stiff = false;
  double brought = 0;  // momentum; for what is stiff only
  bool coarse_assembled = false, coarse_factored = false;
  std::uint64_t factored_rows = 0;  // that pressed when the coarse matrix was factored

  [[nodiscard]] double relative() const { return (report.two_level ? 1 : kBlockJacobiFactor) * o.tolerance; }
  [[nodiscard]] double wanted() const {
    const double whole = stiff ? std::min(norm_b, brought) : norm_b;
    return std::max(relative() * whole, floor);
  }

  void add_second_level() {
    const Clock::time_point start = Clock::now();
    if (!coarse_assembled) {
      w.node_matrix = gains_by_node_matrix(model, o) && !free_piece_touched(w);
      if (w.node_matrix) {
        model.refresh_coarse();
        model.refresh_node_matrix();
        assemble_node_matrix(model, w);
      } else {
        model.refresh_crossings();
      }
      prepare_coarse_space(model, w, o.dt);
      if (w.node_matrix) add_springs_to_node_matrix(model, w);
      coarse_assembled = true;
    }
    // While the same rows press, their coarse matrix hardly changes; but no momentum may hang on an old one.
    const std::uint64_t rows = w.contact.set != nullptr ? name_of(w.contact.pressing) : 0;
    if (!coarse_factored || rows != factored_rows || w.contact.any_free_touched) factor_coarse_space(model, w);
    coarse_factored = true;
    factored_rows = rows;
    report.two_level = true;
    report.seconds_setup += seconds_since(start);
  }

  // The coarse motion that takes up the coarse part of the residual, as a search direction with its product: pieces that
  // rest on something then keep their momentum, whatever the tolerance.
  void coarse_direction() {
    solve_coarse(model, w, o.parallel);
    for (Quad& q : w.preconditioned) store_lanes(q.v, all_lanes(0));
    if (w.contact.set != nullptr)
      for (ToolWork& tool : w.contact.tools) std::fill(tool.preconditioned, tool.preconditioned + 6, 0.0);
    next_direction(model, w, 0, true, o.parallel);
    multiply(model, w, SystemVector::kSearch, o.dt, o.parallel);
  }

  // From the solution so far, whose residual is given.
  void conjugate_gradients(double norm_start, bool first) {
    const bool lean = w.contact.set != nullptr && w.contact.any_free_touched;
    // Contacts that close in this pass ask for far more than will be left of it once the rest of the body gives way: measured by that, what matters would be
    // left undone.
    norm_b = std::max(norm_b, w.contact.set != nullptr
                                  ? std::min(norm_start, std::min(at_pace, w.contact.unforced) + w.contact.asked)
                                  : std::min(norm_start, at_pace));
    if (norm_start == 0) {
      report.stopped_by_floor = true;
      return;
    }
    // In small bodies that something presses on, the coarse space costs less than the iterations that it takes to find out that it is needed.
    const bool small = w.contact.set != nullptr && !w.contact.pressing.empty() && gains_by_node_matrix(model, o);
    bool second = report.two_level || o.preconditioner == Preconditioner::kTwoLevel ||
                  ((lean || small) && o.preconditioner == Preconditioner::kAdaptive);
    if (first && o.preconditioner == Preconditioner::kAdaptive && two_level_steps > 0) {
      --two_level_steps;
      second = true;
    }
    if (second) add_second_level();
    double rr = norm_start * norm_start, rz_old = 0, alpha = 0;
    const bool coarse_start = first && lean && report.two_level;
    if (coarse_start) {
      coarse_direction();
      alpha = 1;
    }
    int settling = 0;
    bool restart = true;
    for (bool started = false;; started = true) {
      const Products now = advance(model, w, alpha, o.parallel);
      rr = now.rr;
      const double residual = std::sqrt(rr);
      if (!started && coarse_start) norm_b = std::min(norm_b, residual);
      if (!(residual > wanted()) &&
          (settling++ >= kMostSettling ||
           (flight_settled(model, w, o.dt, kFlightTolerance * relative(), floor) &&
            turning_settled(model, w, kTurnTolerance * relative(), floor) && every_node_settled(model, w, o)))) {
        report.stopped_by_floor = residual > relative() * norm_b;
        break;
      }
      if (report.iterations >= o.max_iterations) {
        report.cap_hit = true;
        break;
      }
      if (!report.two_level && o.preconditioner == Preconditioner::kAdaptive &&
          report.iterations >= kBlockJacobiPatience) {
        add_second_level();
        two_level_steps = kTwoLevelSteps;
        restart = true;  // another preconditioner: the old directions are not conjugate in it
      }
      const double rz = now.rz + (report.two_level ? solve_coarse(model, w, o.parallel) : 0);
      next_direction(model, w, restart ? 0 : rz / rz_old, report.two_level, o.parallel);
      restart = false;
      rz_old = rz;
      const double pap = multiply(model, w, SystemVector::kSearch, o.dt, o.parallel);
      if (!(pap > 0)) {  // not finite, or nothing left but rounding
        report.cap_hit = true;
        break;
      }
      alpha = rz / pap;
      ++report.iterations;
      if (!report.two_level) ++report.block_jacobi_iterations;
    }
    report.residual = norm_b > 0 ? std::sqrt(rr) / norm_b : 0;
  }

  Status direct() {
    KERF_TRY(direct_solve(model, w, o.dt));
    fresh_residual(model, w, false, o.dt, o.parallel);
    return {};
  }

  Status solve() {
    const Structure& s = model.structure();
    stiff = is_stiff(model, o);
    if (stiff) brought = momentum_brought(model, w, o);
    find_turning(model, w, o);
    floor = o.residual_floor * o.dt * std::max(norm(o.gravity), kFloorGravity) * s.total_mass /
            std::sqrt(static_cast<double>(std::max<std::size_t>(s.free_nodes, 1)));
    if (!s.springs.empty()) at_pace = norm_at_pace(model, w, o.parallel);
    const bool contacts = w.contact.set != nullptr, oracle = o.solver == SolverKind::kDirect,
               iterative = !oracle && attempt != Attempt::kDirectly;
    const bool bonds = !s.bonds.pairs.empty();
    const int wished = contacts ? w.contact.set->options.passes : 1,
              most = std::max(contacts ? kMostPasses * wished : 1, bonds ? kMostBondPasses : 1);
    for (int pass = 0; pass < most; ++pass) {
      const bool last = pass + 1 >= wished;
      if (contacts) {
        const Clock::time_point start = Clock::now();
        assemble_contacts(model, o.dt, last, iterative, w);
        report.seconds_contact += seconds_since(start);
      }
      report.passes = pass + 1;
      const double norm = pass == 0 ? start_solve(model, w, o.dt, o.parallel)
                          : iterative && !w.contact.any_free_touched
                              ? carried_residual(model, w, o.parallel)
                              : fresh_residual(model, w, false, o.dt, o.parallel);
      const bool may_end_early = contacts && pass >= kWholePasses;
      if (may_end_early) start_pass(w);
      if (!iterative) {
        norm_b = std::max(norm_b, norm);
        report.factorised = true;
        KERF_TRY(direct());
      } else {
        conjugate_gradients(norm, pass == 0);
      }
      if (!contacts) {
        const double torn = bonds ? grow_bond_damage(model, w, o.dt) : 0;
        if (!(torn > (oracle ? 1e-9 * norm_b : wanted()))) break;
        if (report.cap_hit && attempt == Attempt::kUntilCap) return {};
        continue;
      }
      const Clock::time_point start = Clock::now();
      const bool whole = !may_end_early || end_pass(model, o.dt, o.parallel, w) == 1;
      double change = update_contacts(o.dt, w);
      if (bonds) change = std::max(change, grow_bond_damage(model, w, o.dt));
      report.seconds_contact += seconds_since(start);
      if (whole && !(change > (oracle ? std::max(1e-12 * norm_b, 0.0) : wanted()))) break;
      if (report.cap_hit && attempt == Attempt::kUntilCap) return {};
    }
    if (iterative && contacts && w.contact.any_free_touched && report.two_level) {
      coarse_direction();
      advance(model, w, 1, o.parallel);
    }
    keep_rigid_momentum(model, w, o);
    carry_crumbs(model, w);
    return {};
  }
};

Status check(const MechanicsModel& model, const MechanicsState& state, const StepOptions& o) {
  if (!(o.dt > 0) || !std::isfinite(o.dt)) return bad_input(fmt::format("step: dt = {} s must be positive", o.dt));
  if (!(o.tolerance > 0) || !(o.tolerance < 1))
    return bad_input(fmt::format("step: tolerance = {} must lie between 0 and 1", o.tolerance));
  if (!(o.residual_floor >= 0))
    return bad_input(fmt::format("step: residual_floor = {} must not be negative", o.residual_floor));
  if (o.max_iterations < 1)
    return bad_input(fmt::format("step: max_iterations = {} must be at least 1", o.max_iterations));
  if (!is_finite(o.gravity)) return bad_input("step: gravity is not finite");
  if (state.positions.size() != model.node_count() || state.velocities.size() != model.node_count())
    return bad_input(fmt::format("step: the state has {} positions and {} velocities, the model {} nodes",
                                 state.positions.size(), state.velocities.size(), model.node_count()));
  if (state.rotations.size() < model.element_count())
    return bad_input(fmt::format("step: the state has {} rotations, the model {} elements", state.rotations.size(),
                                 model.element_count()));
  if (state.bond_damage.size() != model.bond_points().size())
    return bad_input(fmt::format("step: the state has the damage of {} bonds, the model {} bonds",
                                 state.bond_damage.size(), model.bond_points().size()));
  return {};
}

}  // namespace

MechanicsState rest_state(const MechanicsModel& model) {
  MechanicsState state;
  state.positions.assign(model.rest_positions().begin(), model.rest_positions().end());
  state.velocities.resize(model.node_count());
  state.rotations.assign(model.element_count(), model.cells()[0].axes);
  for (std::size_t e = 0; e < model.element_count(); ++e)
    if (model.has_element(HexId(e))) state.rotations[e] = model.cell(model.element(HexId(e)).material).axes;
  state.bond_damage.assign(model.bond_points().size(), 0);
  return state;
}

namespace {

/// One attempt at a step. Where it is given up the report says that the cap was hit, and the state is kept.
Result<StepReport> attempted(MechanicsModel& model, MechanicsState& state, const StepOptions& o, StepWorkspace& w,
                             const ContactSet* contacts, Attempt attempt) {
  const Clock::time_point start = Clock::now();
  KERF_TRY(check(model, state, o));
  if (contacts != nullptr) KERF_TRY(check_contacts(model, state, *contacts));
  model.refresh();
  const Structure& s = model.structure();
  const std::size_t n = model.node_count();
  const bool bonds = !s.bonds.pairs.empty();
  if (bonds) model.follow_bonds(state.bond_damage);
  StepReport report;
  resize(model, w);
  w.node_matrix = false;
  load_state(model, state, w);
  report.inverted_elements = force_pass(model, w, o.parallel);
  spring_force_pass(model, w, o.dt);
  if (bonds) {
    begin_bonds(model, state, w);
    bond_force_pass(model, w);
  }
  right_side_pass(model, w, o);
  report.seconds_forces = seconds_since(start);
  const Clock::time_point setup = Clock::now();
  add_springs_to_cells(model, w, o.dt);
  diagonal_pass(model, w, o);
  report.seconds_setup = seconds_since(setup);
  const Clock::time_point solve = Clock::now();
  w.contact.set = nullptr;
  w.contact.inverse.used = false;
  if (contacts != nullptr) {
    prepare_contacts(model, state, *contacts, o.gravity, o.dt, w);
    report.contacts = static_cast<int>(contacts->rows.size());
    report.seconds_contact = seconds_since(solve);
  } else {
    w.contact.results.clear();
    w.contact.tool_results.clear();
  }
  std::int32_t two_level_steps = state.two_level_steps;
  {
    const double before = report.seconds_setup;
    Solver solver{model, w, o, two_level_steps, report, attempt};
    KERF_TRY(solver.solve());
    if (report.cap_hit && attempt == Attempt::kUntilCap) return report;
    report.seconds_solve = seconds_since(solve) - (report.seconds_setup - before) - report.seconds_contact;
  }
  if (contacts != nullptr) {
    const ContactSummary summary = finish_contacts(o.dt, w);
    report.pressing = summary.pressing;
    report.sliding = summary.sliding;
    report.deepest_overlap = summary.deepest;
  }

  for_each_chunk(o.parallel, n, kNodeGrain, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
    double energy = 0;
    Lanes bound = all_lanes(0);
    for (std::size_t i = begin; i < end; ++i) {
      const Lanes v = load_lanes(w.solution[i].v);
      const Lanes x = load_lanes(w.position[i].v) + o.dt * v;
      store_lanes(w.position[i].v, x);
      energy += s.mass[i] * sum_of(v * v);
      bound += 0.0 * x;  // 0 when finite, else not a number
    }
    w.partial[chunk].v[0] = 0.5 * energy;
    w.partial[chunk].v[1] = sum_of(bound);
  });
  report.kinetic_energy = reduced(w, n, 0);
  bool tools_finite = true;
  if (contacts != nullptr)
    for (const ToolWork& tool : w.contact.tools)
      for (double x : tool.solution) tools_finite = tools_finite && std::isfinite(x);
  if (!std::isfinite(report.kinetic_energy) || reduced(w, n, 1) != 0 || !tools_finite) {
    for (std::size_t i = 0; i < n; ++i)
      if (!is_finite(state.positions[i]) || !is_finite(state.velocities[i]))
        return bad_input(fmt::format("step: node {} is not finite before the step; restore an earlier state", i + 1));
    return failed(
        fmt::format("step: the result is not finite, so the step was refused and the state kept; try a smaller "
                    "time step than {} s, or look for a load, a support velocity or a stiffness that is out of scale",
                    o.part_of > 0 ? o.part_of : o.dt));
  }
  for (std::size_t i = 0; i < n; ++i) {
    state.positions[i] = vec_of(w.position[i]);
    state.velocities[i] = vec_of(w.solution[i]);
  }
  store_rotations(model, w, state);
  if (bonds) {
    state.bond_damage = w.bonds.damage;
    state.bond_dissipated = w.bonds.dissipated;
    report.bonds_broken = w.bonds.broken;
  }
  state.two_level_steps = two_level_steps;
  if (contacts != nullptr) store_contacts(o.dt, w, state);
  else state.contacts.clear();
  w.contact.set = nullptr;
  report.seconds_total = seconds_since(start);
  return report;
}

}  // namespace

Result<StepReport> step(MechanicsModel& model, MechanicsState& state, const StepOptions& o, StepWorkspace& w,
                        const ContactSet* contacts) {
  if (!may_factorise(model, o)) return attempted(model, state, o, w, contacts, Attempt::kAsAsked);
  const Clock::time_point start = Clock::now();
  Result<StepReport> done = attempted(model, state, o, w, contacts, Attempt::kUntilCap);
  if (done && !done->cap_hit) return done;
  done = attempted(model, state, o, w, contacts, Attempt::kDirectly);
  // What rounding makes indefinite as well is left as iterations leave it.
  if (!done) done = attempted(model, state, o, w, contacts, Attempt::kAsAsked);
  if (done) done->seconds_total = seconds_since(start);
  return done;
}

std::vector<Vec3> internal_forces(MechanicsModel& model, const MechanicsState& state) {
  StepWorkspace w;
  model.refresh();
  resize(model, w);
  load_state(model, state, w);
  force_pass(model, w, false);
  for (std::size_t i = model.structure().element_slots; i < w.slot.size(); ++i) store_lanes(w.slot[i].v, all_lanes(0));
  std::vector<Vec3> forces(model.node_count());
  for (std::size_t i = 0; i < forces.size(); ++i) {
    const Lanes f = gathered(model.structure(), w, i);
    forces[i] = {f[0], f[1], f[2]};
  }
  return forces;
}

Vec3 reaction(const MechanicsModel& model, const StepWorkspace& w, const StepOptions& o, NodeId node) {
  if (!model.is_fixed(node) || node.index() >= w.residual.size()) return {};
  return (-1 / o.dt) * vec_of(w.residual[node.index()]);
}

Vec3 spring_force(const MechanicsModel& model, const MechanicsState& state, SpringId id) {
  const RowSpring& spring = model.spring(id);
  Vec3 at, velocity;
  for (int k = 0; k < 8; ++k)
    if (spring.nodes[k].valid()) {
      at += spring.weights[k] * state.positions[spring.nodes[k].index()];
      velocity += spring.weights[k] * state.velocities[spring.nodes[k].index()];
    }
  return spring.stiffness * (spring.target - at) + spring.damping * (spring.target_velocity - velocity);
}

}  // namespace kerf
