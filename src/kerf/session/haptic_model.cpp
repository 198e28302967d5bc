#include "kerf/session/haptic_model.h"

#include <algorithm>
#include <cmath>

namespace kerf {
namespace {

constexpr int kMostRounds = 24;
constexpr int kFree = 6;  // three moves, three turns
using Six = std::array<double, kFree>;

/// Solves the symmetric positive definite system in place (Cholesky); only the lower half is read.
Six solve(std::array<Six, kFree> a, Six b) {
  for (std::size_t j = 0; j < kFree; ++j) {
    for (std::size_t k = 0; k < j; ++k) a[j][j] -= a[j][k] * a[j][k];
    a[j][j] = std::sqrt(std::fmax(a[j][j], 1e-300));
    for (std::size_t i = j + 1; i < kFree; ++i) {
      for (std::size_t k = 0; k < j; ++k) a[i][j] -= a[i][k] * a[j][k];
      a[i][j] /= a[j][j];
    }
  }
  for (std::size_t i = 0; i < kFree; ++i) {
    for (std::size_t k = 0; k < i; ++k) b[i] -= a[i][k] * b[k];
    b[i] /= a[i][i];
  }
  for (std::size_t i = kFree; i-- > 0;) {
    for (std::size_t k = i + 1; k < kFree; ++k) b[i] -= a[k][i] * b[k];
    b[i] /= a[i][i];
  }
  return b;
}

Six row_of(const HapticPlane& plane) {
  const Vec3 turn = cross(plane.arm, plane.normal);
  return {plane.normal.x, plane.normal.y, plane.normal.z, turn.x, turn.y, turn.z};
}

double dot_six(const Six& a, const Six& b) {
  double sum = 0;
  for (std::size_t i = 0; i < kFree; ++i) sum += a[i] * b[i];
  return sum;
}

/// Half the coupling's stretches squared, and the planes'.
double coupling_energy(const HapticModel& model, const Six& wanted, const Six& x) {
  double sum = 0;
  for (std::size_t i = 0; i < kFree; ++i) {
    const double k = i < 3 ? model.stiffness : model.turning_stiffness;
    sum += 0.5 * k * (x[i] - wanted[i]) * (x[i] - wanted[i]);
  }
  return sum;
}
double planes_energy(const HapticModel& model, const std::array<Six, kHapticPlanes>& rows, const Six& x) {
  double sum = 0;
  for (std::size_t p = 0; p < static_cast<std::size_t>(model.plane_count); ++p) {
    const double depth = std::fmax(0.0, model.planes[p].depth + dot_six(rows[p], x));
    sum += 0.5 * model.planes[p].stiffness * depth * depth;
  }
  return sum;
}

}  // namespace

void reduce_contacts(std::span<const HapticContact> contacts, double tissue, HapticModel& model) {
  model.plane_count = 0;
  std::array<const HapticContact*, kHapticPlanes> kept{};
  std::array<double, kHapticPlanes> force{};
  std::size_t n = 0;
  const auto before = [](const HapticContact& a, const HapticContact& b) {
    return a.force != b.force ? a.force > b.force : a.gap < b.gap;
  };
  for (const HapticContact& c : contacts) {  // insertion into a short sorted list
    std::size_t i = std::min(n, kHapticPlanes);
    while (i > 0 && before(c, *kept[i - 1])) --i;
    if (i >= kHapticPlanes) continue;
    for (std::size_t k = std::min(n, kHapticPlanes - 1); k > i; --k) kept[k] = kept[k - 1];
    kept[i] = &c;
    n = std::min(n + 1, kHapticPlanes);
  }
  if (n == 0) return;
  for (const HapticContact& c : contacts) {
    std::size_t home = 0;
    double best = -HUGE_VAL;
    for (std::size_t i = 0; i < n; ++i) {
      if (kept[i] == &c) {
        home = i;
        break;
      }
      const double likeness = dot(c.normal, kept[i]->normal);
      if (likeness > best) best = likeness, home = i;
    }
    force[home] += c.force;
  }
  std::size_t pushing = 0;
  for (std::size_t i = 0; i < n; ++i) pushing += force[i] > 0 ? 1 : 0;
  const double stiffness = tissue / static_cast<double>(std::max<std::size_t>(1, pushing));
  for (std::size_t i = 0; i < n; ++i) {
    HapticPlane& plane = model.planes[i];
    plane.arm = kept[i]->point - model.tool.position;
    plane.normal = kept[i]->normal;
    plane.stiffness = stiffness;
    plane.depth = force[i] > 0 ? force[i] / stiffness : -std::fmax(0.0, kept[i]->gap);
  }
  model.plane_count = static_cast<std::int32_t>(n);
}

HapticAnswer solve_proxy(const HapticModel& model, const RigidPlace& device) {
  const Vec3 move = device.position - model.tool.position;
  const Vec3 rotation = turn_of(product(device.axes, transposed(model.tool.axes)));
  const Six wanted{move.x, move.y, move.z, rotation.x, rotation.y, rotation.z};
  const auto planes = static_cast<std::size_t>(model.plane_count);
  std::array<Six, kHapticPlanes> rows;
  for (std::size_t p = 0; p < planes; ++p) rows[p] = row_of(model.planes[p]);

  Six x{};  // the tool stays, to begin with
  std::uint32_t active_before = ~0u;
  for (int pass = 0; pass < kMostRounds; ++pass) {
    std::array<Six, kFree> a{};
    Six b{};
    for (std::size_t i = 0; i < kFree; ++i) {
      const double k = i < 3 ? model.stiffness : model.turning_stiffness;
      a[i][i] = k;
      b[i] = k * wanted[i];
    }
    std::uint32_t active = 0;
    for (std::size_t p = 0; p < planes; ++p) {
      if (model.planes[p].depth + dot_six(rows[p], x) <= 0) continue;
      active |= 1u << p;
      for (std::size_t i = 0; i < kFree; ++i) {
        b[i] -= model.planes[p].stiffness * model.planes[p].depth * rows[p][i];
        for (std::size_t j = 0; j <= i; ++j) a[i][j] += model.planes[p].stiffness * rows[p][i] * rows[p][j];
      }
    }
    if (active == active_before) break;
    active_before = active;
    const Six full = solve(a, b);
    // Newton's step, halved until the energy falls: the active sets can't go round in circles.
    const auto energy = [&](const Six& at) {
      return coupling_energy(model, wanted, at) + planes_energy(model, rows, at);
    };
    const double now = energy(x);
    Six next = full;
    for (int halved = 0; halved < 8 && energy(next) > now; ++halved)
      for (std::size_t i = 0; i < kFree; ++i) next[i] = x[i] + 0.5 * (next[i] - x[i]);
    x = next;
    if (x != full) active_before = ~0u;
  }

  HapticAnswer out;
  out.tool = {model.tool.position + Vec3{x[0], x[1], x[2]}, product(turn({x[3], x[4], x[5]}), model.tool.axes)};
  out.coupling = coupling_energy(model, wanted, x);
  out.planes = planes_energy(model, rows, x);
  out.wrench.force = model.stiffness * Vec3{x[0] - wanted[0], x[1] - wanted[1], x[2] - wanted[2]};
  out.wrench.torque = model.turning_stiffness * Vec3{x[3] - wanted[3], x[4] - wanted[4], x[5] - wanted[5]};
  if (const double f = norm(out.wrench.force); model.max_force > 0 && f > model.max_force) {
    out.wrench.force = (model.max_force / f) * out.wrench.force;
    out.wrench.torque = (model.max_force / f) * out.wrench.torque;
  }
  return out;
}

}  // namespace kerf
