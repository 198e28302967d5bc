#include "kerf/mechanics/element_pass.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "kerf/base/lanes.h"
#include "kerf/base/rotation.h"
#include "kerf/mechanics/tolerances.h"

namespace kerf {
namespace {

using Quad = StepWorkspace::Quad;
using Batch = MechanicsModel::Batch;
constexpr int kLanes = MechanicsModel::kLanes;

// Corner values of four elements: u[corner][axis] from (x, y, z, 0) per node.
inline void gather(const Batch& batch, const Quad* nodes, Lanes (&u)[8][3]) {
  for (int c = 0; c < 8; ++c) {
    Lanes a = load_lanes(nodes[batch.node[c][0]].v), b = load_lanes(nodes[batch.node[c][1]].v);
    Lanes d = load_lanes(nodes[batch.node[c][2]].v), e = load_lanes(nodes[batch.node[c][3]].v);
    transpose_lanes(a, b, d, e);
    u[c][0] = a;
    u[c][1] = b;
    u[c][2] = d;
  }
}

inline void scatter(Quad* slots, const Lanes (&f)[8][3]) {
  for (int c = 0; c < 8; ++c) {
    Lanes a = f[c][0], b = f[c][1], d = f[c][2], e = all_lanes(0);
    transpose_lanes(a, b, d, e);
    store_lanes(slots[c].v, a);
    store_lanes(slots[8 + c].v, b);
    store_lanes(slots[16 + c].v, d);
    store_lanes(slots[24 + c].v, e);
  }
}

inline void load_rotation(const Quad* in, Lanes (&r)[3][3]) {
  for (int i = 0; i < 9; ++i) r[i / 3][i % 3] = load_lanes(in[i].v);
}

inline void rotate_back(const Lanes (&r)[3][3], Lanes (&u)[3]) {
  const Lanes x = u[0], y = u[1], z = u[2];
  for (int a = 0; a < 3; ++a) u[a] = r[0][a] * x + r[1][a] * y + r[2][a] * z;
}

inline void rotate(const Lanes (&r)[3][3], Lanes (&u)[3]) {
  const Lanes x = u[0], y = u[1], z = u[2];
  for (int a = 0; a < 3; ++a) u[a] = r[a][0] * x + r[a][1] * y + r[a][2] * z;
}

// f = K u for four packed matrices side by side. Three rows, those of a corner, at a time: each number of K
// is read once and the sums of the columns are touched once for three rows.
inline void apply_own(const double* k, const Lanes (&u)[8][3], Lanes (&f)[8][3]) {
  for (int i = 0; i < 24; ++i) f[i / 3][i % 3] = all_lanes(0);
  for (int c = 0; c < 8; ++c) {
    const int length = 24 - 3 * c;  // of the first of the three rows
    const double* k0 = k;
    const double* k1 = k0 + kLanes * length;
    const double* k2 = k1 + kLanes * (length - 1);
    k = k2 + kLanes * (length - 2);
    const Lanes u0 = u[c][0], u1 = u[c][1], u2 = u[c][2];
    const Lanes k01 = load_lanes(k0 + kLanes), k02 = load_lanes(k0 + 2 * kLanes), k12 = load_lanes(k1 + kLanes);
    Lanes s0 = f[c][0] + load_lanes(k0) * u0 + k01 * u1 + k02 * u2;
    Lanes s1 = f[c][1] + k01 * u0 + load_lanes(k1) * u1 + k12 * u2;
    Lanes s2 = f[c][2] + k02 * u0 + k12 * u1 + load_lanes(k2) * u2;
    k0 += 3 * kLanes;
    k1 += 2 * kLanes;
    k2 += kLanes;
    for (int d = c + 1; d < 8; ++d)
      for (int a = 0; a < 3; ++a, k0 += kLanes, k1 += kLanes, k2 += kLanes) {
        const Lanes a0 = load_lanes(k0), a1 = load_lanes(k1), a2 = load_lanes(k2), v = u[d][a];
        s0 += a0 * v;
        s1 += a1 * v;
        s2 += a2 * v;
        f[d][a] += a0 * u0 + a1 * u1 + a2 * u2;
      }
    f[c][0] = s0;
    f[c][1] = s1;
    f[c][2] = s2;
  }
}

// The linear modes of corner values, as the transform makes them: mode[a] = sum over corners, those with bit a subtracted.
inline void linear_modes(const Lanes (&u)[8][3], Lanes (&mode)[3][3]) {
  for (int a = 0; a < 3; ++a)
    for (int i = 0; i < 3; ++i) {
      Lanes sum = u[0][i] - u[1 << a][i];
      for (int c = 1; c < 8; ++c)
        if (c != 1 << a) sum += (c >> a & 1) != 0 ? -u[c][i] : u[c][i];
      mode[a][i] = sum;
    }
}

// Volume times stress (row, column) -> volume times what resists a turn of the cell most: the trace less the least principal value, which
// is at least as large as this (Gershgorin).
inline Lanes turning_tension(const Lanes (&s)[3][3]) {
  using rotation_detail::select;
  const auto size = [](const Lanes& x) { return select(x < 0, -x, x); };
  const Lanes xy = size(0.5 * (s[0][1] + s[1][0])), yz = size(0.5 * (s[1][2] + s[2][1])),
              zx = size(0.5 * (s[2][0] + s[0][2]));
  const Lanes x = s[0][0] - xy - zx, y = s[1][1] - xy - yz, z = s[2][2] - yz - zx;
  const Lanes least = select(x < y, select(x < z, x, z), select(y < z, y, z));
  return s[0][0] + s[1][1] + s[2][2] - least;
}

// Forces of the linear modes, from the modes of a motion: tension times the spin of the cell of size h.
inline void turn_back(const Lanes& tension, Vec3 h, const Lanes (&u)[3][3], Lanes (&f)[3][3]) {
  const double q[3] = {-0.25 / h.x, -0.25 / h.y, -0.25 / h.z};
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    const Lanes torque = 0.25 * tension * (q[i] * u[i][j] - q[j] * u[j][i]);
    f[i][j] = q[i] * torque;
    f[j][i] = -q[j] * torque;
  }
  for (int k = 0; k < 3; ++k) f[k][k] = all_lanes(0);
}

// What corner 0 of a cell of size h feels of its own motion, for a tension of one: components xx yy zz xy yz zx.
inline std::array<double, 6> turning_stiffness(Vec3 h) {
  const double slope[3] = {0.25 / h.x, 0.25 / h.y, 0.25 / h.z};
  std::array<double, 6> out;
  for (std::size_t i = 0; i < 3; ++i) {
    const double first = slope[(i + 1) % 3], second = slope[(i + 2) % 3];
    out[i] = 0.25 * (first * first + second * second);
    out[3 + i] = -0.25 * slope[i] * first;
  }
  return out;
}

// What turning_tension says of the stretch that the step before has made by turning a cell: it goes along tangents, so across the axis of a spin w lengths
// grow by about (w dt)^2 / 2. Taken for tension, it would brake what turns about a support or an edge.
double made_by_turning(const MechanicsModel& model, const StepWorkspace& w, std::size_t batch, int lane, double dt,
                       double volume) {
  const Batch& b = model.structure().batches[batch];
  const MechanicsElement& e = model.element(HexId(b.element[lane]));
  const Material& material = model.materials()[e.material];
  const Vec3 h = model.cells()[b.cell].size;
  double rate[3][3] = {};  // velocity (row) by axis of the cell
  for (int c = 0; c < 8; ++c) {
    const double* v = w.velocity[e.nodes[c].index()].v;
    for (int i = 0; i < 3; ++i)
      for (int a = 0; a < 3; ++a) rate[i][a] += corner_sign(c, a) * v[i] / (4 * h[a]);
  }
  double own[3][3] = {};  // in the axes of the cell
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i)
      for (int a = 0; a < 3; ++a) own[j][a] += w.rotation[9 * batch + 3 * i + j].v[lane] * rate[i][a];
  const Vec3 turn = 0.5 * dt * Vec3{own[2][1] - own[1][2], own[0][2] - own[2][0], own[1][0] - own[0][1]};
  // Seen from where it has got to, what went along a tangent by tan x turned by sin x, and is longer by 1 / cos x - 1.
  // Damping leaves of that from step to step what the next one can't take back.
  const double square = dot(turn, turn), longer = (1 + material.damping_stiffness / dt) *
                                                  (1 / std::sqrt(1 - std::min(square, kFarthestTurn)) - 1);
  if (!(square > 0)) return 0;
  const double shear = material.young * e.young_scale / (2 * (1 + material.poisson)),
               bulk = 2 * shear * material.poisson / (1 - 2 * material.poisson);
  double stress[3][3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      stress[i][j] = 2 * volume * longer * ((i == j ? bulk + shear : 0) - shear * turn[i] * turn[j] / square);
  double least = HUGE_VAL;
  for (int i = 0; i < 3; ++i)
    least = std::min(least, stress[i][i] - std::abs(stress[i][(i + 1) % 3]) - std::abs(stress[i][(i + 2) % 3]));
  return stress[0][0] + stress[1][1] + stress[2][2] - least;
}

inline bool any_of_lanes(const Lanes& x) { return x[0] != 0 || x[1] != 0 || x[2] != 0 || x[3] != 0; }

inline Lanes young_scales(const MechanicsModel& model, const Batch& batch) {
  Lanes s = all_lanes(0);
  for (int lane = 0; lane < kLanes; ++lane)
    if (batch.element[lane] >= 0) s[lane] = model.element(HexId(batch.element[lane])).young_scale;
  return s;
}

const double* own_with_springs(const MechanicsModel& model, const StepWorkspace& w, const Batch& batch) {
  if (batch.sprung < 0) return model.own_block(batch.own);
  return w.sprung.data() + MechanicsModel::kOwnBlock * static_cast<std::size_t>(batch.sprung);
}

/// Natural edges of the cells over those at rest, axis by axis.
inline void natural_lengths(const MechanicsModel& model, const Batch& batch, Lanes (&out)[3]) {
  for (Lanes& x : out) x = all_lanes(1);
  for (int lane = 0; lane < kLanes; ++lane) {
    if (batch.element[lane] < 0) continue;
    const Vec3 stretch =
        model.materials()[static_cast<std::size_t>(model.element(HexId(batch.element[lane])).material)].prestretch;
    for (int a = 0; a < 3; ++a) out[a][lane] = 1 / stretch[a];
  }
}

}  // namespace

int element_force_pass(const MechanicsModel& model, StepWorkspace& w, std::size_t begin, std::size_t end) {
  const MechanicsModel::Structure& s = model.structure();
  const std::span<const ElementCell> cells = model.cells();
  int inverted = 0;
  for (std::size_t b = begin; b < end; ++b) {
    const Batch& batch = s.batches[b];
    const Vec3 h = cells[batch.cell].size;
    Lanes u[8][3];
    gather(batch, w.position.data(), u);
    // Relative to corner 0: an exact difference, so far from the origin no digit is lost in the sums below.
    for (int c = 7; c >= 0; --c)
      for (int a = 0; a < 3; ++a) u[c][a] -= u[0][a];
    walsh_hadamard_transform(u);  // mode 0 is 8 times the centre; it does not matter
    // The linear modes 1, 2, 4 are the deformation gradient: sum of s_x x = 4 h_x F e_x (mode 1 counts corner
    // 1 as -).
    const double h4[3] = {-4 * h.x, -4 * h.y, -4 * h.z};
    Lanes f[3][3];
    for (int a = 0; a < 3; ++a)
      for (int j = 0; j < 3; ++j) f[a][j] = u[1 << j][a] / h4[j];
    Lanes r[3][3];
    Quad* stored = w.rotation.data() + 9 * b;
    load_rotation(stored, r);
    for (int k = 0; k < kRotationIterations; ++k) improve_rotation(f, r);
    orthonormalise(r);
    for (int i = 0; i < 9; ++i) store_lanes(stored[i].v, r[i / 3][i % 3]);
    const Lanes det = f[0][0] * (f[1][1] * f[2][2] - f[1][2] * f[2][1]) -
                      f[0][1] * (f[1][0] * f[2][2] - f[1][2] * f[2][0]) +
                      f[0][2] * (f[1][0] * f[2][1] - f[1][1] * f[2][0]);
    for (int lane = 0; lane < kLanes; ++lane)
      if (batch.element[lane] >= 0 && !(det[lane] > 0)) ++inverted;

    for (int m = 1; m < 8; ++m) rotate_back(r, u[m]);
    Lanes natural[3];
    natural_lengths(model, batch, natural);
    for (int a = 0; a < 3; ++a) {
      u[0][a] = all_lanes(0);
      u[1 << a][a] -= h4[a] * natural[a];
    }
    const Lanes scale = -young_scales(model, batch);
    Lanes stress[3][3];  // times the volume
    if (batch.own < 0) {
      apply_blocks(s.shared[batch.material], u);
      for (int a = 0; a < 3; ++a)
        for (int i = 0; i < 3; ++i) stress[i][a] = h4[a] * u[1 << a][i];
      for (int m = 1; m < 8; ++m) {
        rotate(r, u[m]);
        for (int a = 0; a < 3; ++a) u[m][a] *= scale;
      }
      for (int a = 0; a < 3; ++a) u[0][a] = all_lanes(0);
      walsh_hadamard_transform(u);
      scatter(w.slot.data() + 32 * b, u);
    } else {
      walsh_hadamard_transform(u);  // back to corners, times 8
      Lanes force[8][3];
      apply_own(model.own_block(batch.own), u, force);
      Lanes mode[3][3];
      linear_modes(force, mode);
      for (int a = 0; a < 3; ++a)
        for (int i = 0; i < 3; ++i) stress[i][a] = h4[a] / 64 * mode[a][i];
      for (int c = 0; c < 8; ++c) {
        rotate(r, force[c]);
        for (int a = 0; a < 3; ++a) force[c][a] *= 0.125 * scale;
      }
      scatter(w.slot.data() + 32 * b, force);
    }
    store_lanes(w.tension[b].v, -scale * turning_tension(stress));
  }
  return inverted;
}

void element_scale_pass(const MechanicsModel& model, StepWorkspace& w, double dt, bool weight, std::size_t begin,
                        std::size_t end) {
  const MechanicsModel::Structure& s = model.structure();
  const std::span<const ElementCell> cells = model.cells();
  for (std::size_t b = begin; b < end; ++b) {
    const Batch& batch = s.batches[b];
    const Vec3 h = cells[batch.cell].size;
    const double least = std::min({h.x, h.y, h.z});
    Lanes scale = all_lanes(0);
    for (int lane = 0; lane < kLanes; ++lane) {
      double& tension = w.tension[b].v[lane];
      const double whole = dt * dt * tension;
      tension = 0;
      if (batch.element[lane] < 0) continue;
      const HexId id(batch.element[lane]);
      const MechanicsElement& e = model.element(id);
      const double damping = model.materials()[e.material].damping_stiffness;
      const double square = (dt * dt + dt * damping) * e.young_scale;
      scale[lane] = std::sqrt(square);
      if (!(whole > 0)) continue;
      if (!weight && s.rigid.is_free(e.nodes)) continue;
      const auto& masses = model.element_masses(id);
      const Material& material = model.materials()[e.material];
      const double mass = std::accumulate(masses.begin(), masses.end(), 0.0);
      const double thick = least * std::min(1.0, mass / (material.density * h.x * h.y * h.z));
      const double sound = std::sqrt(material.young * e.young_scale / material.density);
      double excess = whole - mass * std::max(kTautness * least * least, kTautBending * thick * dt * sound);
      if (!(excess > 0) || !(square > 0)) continue;
      const double made = dt * dt * made_by_turning(model, w, b, lane, dt, mass / material.density);
      if (made > kMadeByTurning * whole) excess -= made;
      if (excess > 0) tension = excess / square;
    }
    for (int i = 0; i < 9; ++i)
      store_lanes(w.scaled_rotation[9 * b + i].v, scale * load_lanes(w.rotation[9 * b + i].v));
  }
}

namespace {

// (dt^2 + dt b) R K R' p of a batch of full cells.
inline void full_stiffness(const MechanicsModel& model, const StepWorkspace& w, const std::vector<Quad>& p,
                           std::size_t b, Lanes (&u)[8][3]) {
  const MechanicsModel::Structure& s = model.structure();
  const Batch& batch = s.batches[b];
  Lanes r[3][3];
  load_rotation(w.scaled_rotation.data() + 9 * b, r);
  gather(batch, p.data(), u);
  const Lanes tension = load_lanes(w.tension[b].v);
  const bool taut = any_of_lanes(tension);
  Lanes linear[3][3], back[3][3];
  walsh_hadamard_transform(u);
  for (int m = 1; m < 8; ++m) rotate_back(r, u[m]);
  for (int a = 0; a < 3; ++a) u[0][a] = all_lanes(0);
  if (taut) {
    for (int i = 0; i < 9; ++i) linear[i / 3][i % 3] = u[1 << i / 3][i % 3];
    turn_back(tension, model.cells()[batch.cell].size, linear, back);
  }
  apply_blocks(s.shared[batch.material], u);
  if (taut)
    for (int i = 0; i < 9; ++i) u[1 << i / 3][i % 3] += back[i / 3][i % 3];
  for (int m = 1; m < 8; ++m) rotate(r, u[m]);
  for (int a = 0; a < 3; ++a) u[0][a] = all_lanes(0);
  walsh_hadamard_transform(u);
}

}  // namespace

void element_sum_pass(const MechanicsModel& model, StepWorkspace& w, const std::vector<Quad>& p, std::size_t begin,
                      std::size_t end) {
  const MechanicsModel::Structure& s = model.structure();
  Quad* const sums = w.product.data();
  for (std::size_t b = begin; b < end; ++b) {
    Lanes u[8][3];
    full_stiffness(model, w, p, b, u);
    Quad by_element[32];
    scatter(by_element, u);
    const auto& to = s.sum_of[b];
    for (int lane = 0; lane < kLanes; ++lane)
      for (int c = 0; c < 8; ++c) {
        const std::int32_t sum = to[c][lane];
        const Lanes f = load_lanes(by_element[8 * lane + c].v);
        if (sum >= 0) store_lanes(sums[sum].v, load_lanes(sums[sum].v) + f);
        else store_lanes(sums[~sum].v, all_lanes(0) + f);
      }
  }
}

void element_stiffness_pass(const MechanicsModel& model, StepWorkspace& w, const std::vector<Quad>& p,
                            std::size_t begin, std::size_t end) {
  const MechanicsModel::Structure& s = model.structure();
  const std::span<const ElementCell> cells = model.cells();
  for (std::size_t b = begin; b < end; ++b) {
    const Batch& batch = s.batches[b];
    Lanes u[8][3];
    Lanes r[3][3], f[8][3];
    load_rotation(w.scaled_rotation.data() + 9 * b, r);
    gather(batch, p.data(), u);
    const Lanes tension = load_lanes(w.tension[b].v);
    for (int c = 0; c < 8; ++c) rotate_back(r, u[c]);
    apply_own(own_with_springs(model, w, batch), u, f);
    if (any_of_lanes(tension)) {
      Lanes linear[3][3], back[3][3];
      linear_modes(u, linear);
      turn_back(tension, cells[batch.cell].size, linear, back);
      for (int c = 0; c < 8; ++c)
        for (int i = 0; i < 9; ++i) f[c][i % 3] += (c >> i / 3 & 1) != 0 ? -back[i / 3][i % 3] : back[i / 3][i % 3];
    }
    for (int c = 0; c < 8; ++c) rotate(r, f[c]);
    scatter(w.slot.data() + 32 * b, f);
  }
}

void element_diagonal_pass(const MechanicsModel& model, StepWorkspace& w, std::size_t begin, std::size_t end) {
  const MechanicsModel::Structure& s = model.structure();
  // Components in the order xx yy zz xy yz zx.
  constexpr int kRow[6] = {0, 1, 2, 0, 1, 2}, kColumn[6] = {0, 1, 2, 1, 2, 0};
  const std::span<const ElementCell> cells = model.cells();
  const auto write = [&](std::size_t b, int corner, const Lanes(&d)[6]) {
    Lanes a0 = d[0], a1 = d[1], a2 = d[2], a3 = d[3];
    Lanes b0 = d[4], b1 = d[5], b2 = all_lanes(0), b3 = all_lanes(0);
    transpose_lanes(a0, a1, a2, a3);
    transpose_lanes(b0, b1, b2, b3);
    const Lanes first[4] = {a0, a1, a2, a3}, second[4] = {b0, b1, b2, b3};
    for (int lane = 0; lane < kLanes; ++lane) {
      Quad* out = w.diagonal_slot.data() + 2 * (32 * b + 8 * lane + corner);
      store_lanes(out[0].v, first[lane]);
      store_lanes(out[1].v, second[lane]);
    }
  };
  for (std::size_t b = begin; b < end; ++b) {
    const Batch& batch = s.batches[b];
    Lanes r[3][3];
    load_rotation(w.scaled_rotation.data() + 9 * b, r);
    const Lanes tension = load_lanes(w.tension[b].v);
    const std::array<double, 6> turning = turning_stiffness(cells[batch.cell].size);
    if (batch.own < 0) {
      Lanes k[6];
      for (int i = 0; i < 6; ++i) k[i] = s.shared[batch.material].corner[i] + tension * turning[i];
      Lanes base[6], xy[6], yz[6], zx[6];
      for (int i = 0; i < 6; ++i) {
        const Lanes* p = r[kRow[i]];
        const Lanes* q = r[kColumn[i]];
        base[i] = k[0] * (p[0] * q[0]) + k[1] * (p[1] * q[1]) + k[2] * (p[2] * q[2]);
        xy[i] = k[3] * (p[0] * q[1] + p[1] * q[0]);
        yz[i] = k[4] * (p[1] * q[2] + p[2] * q[1]);
        zx[i] = k[5] * (p[2] * q[0] + p[0] * q[2]);
      }
      Lanes d[6];
      for (int i = 0; i < 6; ++i) d[i] = base[i] + xy[i] + yz[i] + zx[i];
      write(b, 0, d);
      for (int i = 0; i < 6; ++i) d[i] = base[i] - xy[i] + yz[i] - zx[i];  // x mirrored
      write(b, 1, d);
      for (int i = 0; i < 6; ++i) d[i] = base[i] - xy[i] - yz[i] + zx[i];  // y mirrored
      write(b, 2, d);
      for (int i = 0; i < 6; ++i) d[i] = base[i] + xy[i] - yz[i] - zx[i];  // z mirrored, as x and y together
      write(b, 3, d);
    } else {
      const double* k = own_with_springs(model, w, batch);
      const auto packed = [&](int i, int j) { return load_lanes(k + kLanes * packed_place(i, j)); };
      for (int c = 0; c < 8; ++c) {
        const int o = 3 * c;
        const double xy = (c ^ c >> 1) & 1 ? -1 : 1, yz = (c >> 1 ^ c >> 2) & 1 ? -1 : 1, zx = xy * yz;
        const Lanes own[6] = {packed(o, o) + tension * turning[0],
                              packed(o + 1, o + 1) + tension * turning[1],
                              packed(o + 2, o + 2) + tension * turning[2],
                              packed(o, o + 1) + xy * tension * turning[3],
                              packed(o + 1, o + 2) + yz * tension * turning[4],
                              packed(o, o + 2) + zx * tension * turning[5]};
        const Lanes m[3][3] = {{own[0], own[3], own[5]}, {own[3], own[1], own[4]}, {own[5], own[4], own[2]}};
        Lanes mr[3][3];  // M R'
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) mr[i][j] = m[i][0] * r[j][0] + m[i][1] * r[j][1] + m[i][2] * r[j][2];
        Lanes d[6];
        for (int i = 0; i < 6; ++i) {
          const Lanes* p = r[kRow[i]];
          const int q = kColumn[i];
          d[i] = p[0] * mr[0][q] + p[1] * mr[1][q] + p[2] * mr[2][q];
        }
        write(b, c, d);
      }
    }
  }
}

}  // namespace kerf
