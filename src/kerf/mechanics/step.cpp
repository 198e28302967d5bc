#include "kerf/mechanics/step.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>

#include "kerf/mechanics/chunked_loop.h"
#include "kerf/mechanics/direct_solver.h"
#include "kerf/mechanics/element_pass.h"
#include "kerf/mechanics/lanes.h"

namespace kerf {
namespace {

using Quad = StepWorkspace::Quad;
using Structure = MechanicsModel::Structure;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

Lanes lanes_of(Vec3 v) {
  return Lanes{v.x, v.y, v.z, 0};
}
Vec3 vec_of(const Quad& q) {
  return {q.v[0], q.v[1], q.v[2]};
}
double sum_of(const Lanes& v) {
  return (v[0] + v[1]) + v[2];
}

void resize(const MechanicsModel& model, StepWorkspace& w) {
  const Structure& s = model.structure();
  const std::size_t n = model.node_count();
  for (std::vector<Quad>* v : {&w.position, &w.velocity, &w.right_side, &w.solution, &w.residual, &w.search,
                               &w.product, &w.preconditioned})
    v->resize(n);
  w.slot.resize(s.element_slots + 8 * s.springs.size());
  w.mass_diagonal.resize(n);
  w.inverse_diagonal.resize(3 * n);
  w.diagonal_slot.resize(2 * s.element_slots);
  w.rotation.resize(9 * s.batches.size());
  w.scaled_rotation.resize(9 * s.batches.size());
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
      const Mat3 r = e >= 0 ? state.rotations[e] : model.axes();
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
  for (std::int32_t i = s.slot_begin[node]; i < s.slot_begin[node + 1]; ++i)
    sum += load_lanes(w.slot[s.slots[i]].v);
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
      if (spring.nodes[k].valid())
        at += spring.weights[k] * load_lanes(w.position[spring.nodes[k].index()].v);
    const Lanes force =
        spring.stiffness * (lanes_of(spring.target) - at) + spring.damping * lanes_of(spring.target_velocity);
    for (int k = 0; k < 8; ++k) store_lanes(w.slot[s.element_slots + 8 * i + k].v, spring.weights[k] * force);
  }
}

void spring_stiffness_pass(const MechanicsModel& model, StepWorkspace& w, const std::vector<Quad>& p) {
  const Structure& s = model.structure();
  for (std::size_t i = 0; i < s.springs.size(); ++i) {
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
  for_each_chunk(o.parallel, model.node_count(), kNodeGrain,
                 [&](std::size_t begin, std::size_t end, std::size_t) {
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
  for_each_chunk(o.parallel, s.batches.size(), kBatchGrain,
                 [&](std::size_t begin, std::size_t end, std::size_t) {
                   element_scale_pass(model, w, o.dt, begin, end);
                   element_diagonal_pass(model, w, begin, end);
                 });
  const std::size_t full_slots = s.full_batches * 32;
  for_each_chunk(o.parallel, model.node_count(), kNodeGrain,
                 [&](std::size_t begin, std::size_t end, std::size_t) {
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
                       } else {
                         const std::size_t spring = (slot - s.element_slots) / 8;
                         const double weight = model.springs()[s.springs[spring]].weights[slot & 7];
                         const double x = w.spring_scale[spring] * weight * weight;
                         first += Lanes{x, x, x, 0};
                       }
                     }
                     const double xx = first[0], yy = first[1], zz = first[2], xy = first[3], yz = second[0],
                                  zx = second[1];
                     const double cxx = yy * zz - yz * yz, cxy = yz * zx - xy * zz, czx = xy * yz - zx * yy;
                     const double inverse = 1 / (xx * cxx + xy * cxy + zx * czx);
                     const double cyy = xx * zz - zx * zx, cyz = xy * zx - xx * yz, czz = xx * yy - xy * xy;
                     store_lanes(out[0].v, inverse * Lanes{cxx, cxy, czx, 0});
                     store_lanes(out[1].v, inverse * Lanes{cxy, cyy, cyz, 0});
                     store_lanes(out[2].v, inverse * Lanes{czx, cyz, czz, 0});
                   }
                 });
}

double reduced(const StepWorkspace& w, std::size_t n, int component) {
  double sum = 0;
  for (std::size_t c = 0; c * kNodeGrain < n; ++c) sum += w.partial[c].v[component];
  return sum;
}

// product = A p for all nodes; returns p' A p.
double multiply(const MechanicsModel& model, StepWorkspace& w, const std::vector<Quad>& p, bool parallel) {
  const Structure& s = model.structure();
  const std::size_t n = model.node_count();
  for_each_chunk(parallel, s.batches.size(), kBatchGrain,
                 [&](std::size_t begin, std::size_t end, std::size_t) {
                   element_stiffness_pass(model, w, p, begin, end);
                 });
  spring_stiffness_pass(model, w, p);
  for_each_chunk(parallel, n, kNodeGrain, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
    Lanes dot = all_lanes(0);
    for (std::size_t i = begin; i < end; ++i) {
      const Lanes x = load_lanes(p[i].v);
      const Lanes y = w.mass_diagonal[i] * x + gathered(s, w, i);
      store_lanes(w.product[i].v, y);
      dot += x * y;
    }
    w.partial[chunk].v[0] = sum_of(dot);
  });
  return reduced(w, n, 0);
}

struct Products {
  double rz = 0;  // r' z with the block-Jacobi part of z
  double rr = 0;  // r' r over what moves
};

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
  return {reduced(w, n, 0), reduced(w, n, 1)};
}

// p = z + beta p, where z gets its coarse part here: t + w x arm of the node's group.
void next_direction(const MechanicsModel& model, StepWorkspace& w, double beta, bool two_level,
                    bool parallel) {
  for_each_chunk(
      parallel, model.node_count(), kNodeGrain, [&](std::size_t begin, std::size_t end, std::size_t) {
        if (!two_level) {
          for (std::size_t i = begin; i < end; ++i)
            store_lanes(w.search[i].v, load_lanes(w.preconditioned[i].v) + beta * load_lanes(w.search[i].v));
          return;
        }
        const CoarseStructure& c = model.coarse();
        for (std::size_t i = begin; i < end; ++i) {
          Lanes p = load_lanes(w.preconditioned[i].v) + beta * load_lanes(w.search[i].v);
          if (c.place[i] >= 0) {
            const double* y = w.coarse.value.data() + kBlockRow * static_cast<std::size_t>(c.place[i]);
            p += Lanes{y[0], y[1], y[2], 0} + cross_lanes(Lanes{y[3], y[4], y[5], 0}, load_lanes(w.arm[i].v));
          }
          store_lanes(w.search[i].v, p);
        }
      });
}

// Starts from zero; held nodes from their prescribed velocity, free pieces from their rigid motion. Returns
// the norm of the residual, which for a body that rests on something is the right-hand side.
double start_solve(const MechanicsModel& model, StepWorkspace& w, bool parallel) {
  const Structure& s = model.structure();
  const std::size_t n = model.node_count();
  bool nonzero = !s.rigid.free.empty();
  for (std::size_t i = 0; i < n; ++i) {
    const bool held = model.is_fixed(NodeId(i));
    const Vec3 v = held ? model.prescribed_velocities()[i] : Vec3{};
    nonzero = nonzero || !(v == Vec3{});
    store_lanes(w.solution[i].v, lanes_of(v));
  }
  if (!s.rigid.free.empty()) {
    w.residual = w.right_side;
    absorb_rigid_momentum(model, w);
  }
  if (nonzero) multiply(model, w, w.solution, parallel);
  for_each_chunk(parallel, n, kNodeGrain, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
    Lanes bb = all_lanes(0);
    for (std::size_t i = begin; i < end; ++i) {
      Lanes r = load_lanes(w.right_side[i].v);
      if (nonzero) r -= load_lanes(w.product[i].v);
      store_lanes(w.residual[i].v, r);
      store_lanes(w.search[i].v, all_lanes(0));
      store_lanes(w.product[i].v, all_lanes(0));
      bb += s.free[i] * (r * r);
    }
    w.partial[chunk].v[0] = sum_of(bb);
  });
  return std::sqrt(reduced(w, n, 0));
}

void conjugate_gradients(MechanicsModel& model, StepWorkspace& w, const StepOptions& o,
                         std::int32_t& two_level_steps, StepReport& report) {
  const Structure& s = model.structure();
  const double norm_b = start_solve(model, w, o.parallel);
  const double floor = o.residual_floor * o.dt * std::max(norm(o.gravity), kFloorGravity) * s.total_mass /
                       std::sqrt(static_cast<double>(std::max<std::size_t>(s.free_nodes, 1)));
  if (norm_b == 0) {
    report.stopped_by_floor = true;
    return;
  }
  const auto add_second_level = [&] {
    const Clock::time_point start = Clock::now();
    model.refresh_coarse();
    prepare_coarse_space(model, w);
    report.two_level = true;
    report.seconds_setup += seconds_since(start);
  };
  if (o.preconditioner == Preconditioner::kTwoLevel) add_second_level();
  if (o.preconditioner == Preconditioner::kAdaptive && two_level_steps > 0) {
    --two_level_steps;
    add_second_level();
  }
  double rr = norm_b * norm_b, rz_old = 0, alpha = 0;
  bool restart = true;
  for (;;) {
    const Products now = advance(model, w, alpha, o.parallel);
    rr = now.rr;
    const double residual = std::sqrt(rr);
    const double wanted = (report.two_level ? 1 : kBlockJacobiFactor) * o.tolerance * norm_b;
    if (!(residual > std::max(wanted, floor))) {
      report.stopped_by_floor = residual > wanted;
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
    const double pap = multiply(model, w, w.search, o.parallel);
    if (!(pap > 0)) {  // not finite, or nothing left but rounding
      report.cap_hit = true;
      break;
    }
    alpha = rz / pap;
    ++report.iterations;
    if (!report.two_level) ++report.block_jacobi_iterations;
  }
  report.residual = std::sqrt(rr) / norm_b;
  absorb_rigid_momentum(model, w);
}

Status check(const MechanicsModel& model, const MechanicsState& state, const StepOptions& o) {
  if (!(o.dt > 0) || !std::isfinite(o.dt))
    return bad_input(fmt::format("step: dt = {} s must be positive", o.dt));
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
    return bad_input(fmt::format("step: the state has {} rotations, the model {} elements",
                                 state.rotations.size(), model.element_count()));
  return {};
}

}  // namespace

MechanicsState rest_state(const MechanicsModel& model) {
  MechanicsState state;
  state.positions.assign(model.rest_positions().begin(), model.rest_positions().end());
  state.velocities.resize(model.node_count());
  state.rotations.assign(model.element_count(), model.axes());
  return state;
}

Result<StepReport> step(MechanicsModel& model, MechanicsState& state, const StepOptions& o,
                        StepWorkspace& w) {
  const Clock::time_point start = Clock::now();
  KERF_TRY(check(model, state, o));
  model.refresh();
  const Structure& s = model.structure();
  const std::size_t n = model.node_count();
  StepReport report;
  resize(model, w);
  load_state(model, state, w);
  report.inverted_elements = force_pass(model, w, o.parallel);
  spring_force_pass(model, w, o.dt);
  right_side_pass(model, w, o);
  report.seconds_forces = seconds_since(start);
  const Clock::time_point setup = Clock::now();
  diagonal_pass(model, w, o);
  report.seconds_setup = seconds_since(setup);
  const Clock::time_point solve = Clock::now();
  std::int32_t two_level_steps = state.two_level_steps;
  if (o.solver == SolverKind::kDirect) {
    start_solve(model, w, o.parallel);
    KERF_TRY(direct_solve(model, w, o.dt));
    multiply(model, w, w.solution, o.parallel);
    for (std::size_t i = 0; i < n; ++i)
      store_lanes(w.residual[i].v, load_lanes(w.right_side[i].v) - load_lanes(w.product[i].v));
  } else {
    const double before = report.seconds_setup;
    conjugate_gradients(model, w, o, two_level_steps, report);
    report.seconds_solve = seconds_since(solve) - (report.seconds_setup - before);
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
  if (!std::isfinite(report.kinetic_energy) || reduced(w, n, 1) != 0) {
    for (std::size_t i = 0; i < n; ++i)
      if (!is_finite(state.positions[i]) || !is_finite(state.velocities[i]))
        return bad_input(
            fmt::format("step: node {} is not finite before the step; restore an earlier state", i + 1));
    return failed(fmt::format(
        "step: the result is not finite, so the step was refused and the state kept; try a smaller "
        "dt than {} s, or look for a load or a support velocity that is out of scale",
        o.dt));
  }
  for (std::size_t i = 0; i < n; ++i) {
    state.positions[i] = vec_of(w.position[i]);
    state.velocities[i] = vec_of(w.solution[i]);
  }
  store_rotations(model, w, state);
  state.two_level_steps = two_level_steps;
  report.seconds_total = seconds_since(start);
  return report;
}

std::vector<Vec3> internal_forces(MechanicsModel& model, const MechanicsState& state) {
  StepWorkspace w;
  model.refresh();
  resize(model, w);
  load_state(model, state, w);
  force_pass(model, w, false);
  for (std::size_t i = model.structure().element_slots; i < w.slot.size(); ++i)
    store_lanes(w.slot[i].v, all_lanes(0));
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
