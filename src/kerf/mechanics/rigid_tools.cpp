#include "kerf/mechanics/rigid_tools.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kerf/base/rigid_place.h"

namespace kerf {
namespace {

// Limits a spring and damper to a force, as a secant: weaker for this step.
double limited(double most, Vec3 force) {
  const double size = norm(force);
  return most > 0 && size > most ? most / size : 1;
}

// What a body of effective mass m under this impulse needs on its diagonal to stay under a speed.
double slowed(double m, Vec3 impulse, double fastest) { return std::max(m, norm(impulse) / fastest); }

}  // namespace

Status check_tool(const RigidTool& t, const RigidState& s, std::size_t index) {
  const auto refuse = [&](const char* what) { return bad_input(fmt::format("tool {}: {}", index + 1, what)); };
  const auto positive = [](double x) { return x > 0 && std::isfinite(x); };
  const auto not_negative = [](double x) { return x >= 0 && std::isfinite(x); };
  if (!positive(t.mass) || !positive(t.inertia)) return refuse("mass and inertia must be positive");
  if (!not_negative(t.stiffness) || !not_negative(t.damping) || !not_negative(t.turning_stiffness) ||
      !not_negative(t.turning_damping))
    return refuse("stiffness and damping of its coupling must not be negative");
  if (!not_negative(t.max_force) || !not_negative(t.max_torque))
    return refuse("its limits of force must not be negative");
  if (!positive(t.max_speed) || !positive(t.max_spin)) return refuse("its limits of speed must be positive");
  if (!is_finite(t.force) || !is_finite(t.torque)) return refuse("the force on it is not finite");
  if (!is_finite(t.target) || !is_finite(t.target_velocity) || !is_finite(t.target_spin))
    return refuse("its pose is not finite");
  if (!is_finite(s.position) || !is_finite(s.velocity) || !is_finite(s.spin)) return refuse("its state is not finite");
  for (const Mat3* m : {&t.target_axes, &s.axes})
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        if (!(std::abs(dot(m->c[i], m->c[j]) - (i == j ? 1 : 0)) < 1e-6)) return refuse("its axes are not a rotation");
  return {};
}

void prepare_tool(const RigidTool& t, const RigidState& s, double h, ToolWork& w) {
  w = {};
  w.length = std::sqrt(t.inertia / t.mass);
  w.velocity = s.velocity;
  w.spin = s.spin;
  w.offset = t.target - s.position;
  w.turn_offset = turn_of(product(t.target_axes, transposed(s.axes)));
  const double weaker = limited(t.max_force, t.stiffness * w.offset + t.damping * (t.target_velocity - s.velocity));
  w.stiffness = weaker * t.stiffness;
  w.damping = weaker * t.damping;
  const double turn_weaker =
      limited(t.max_torque, t.turning_stiffness * w.turn_offset + t.turning_damping * (t.target_spin - s.spin));
  w.turning_stiffness = turn_weaker * t.turning_stiffness;
  w.turning_damping = turn_weaker * t.turning_damping;
  const Vec3 push = t.mass * s.velocity + h * (w.stiffness * w.offset + w.damping * t.target_velocity + t.force);
  const Vec3 twist =
      t.inertia * s.spin + h * (w.turning_stiffness * w.turn_offset + w.turning_damping * t.target_spin + t.torque);
  w.mass = slowed(t.mass + h * w.damping + h * h * w.stiffness, push, t.max_speed);
  w.inertia = slowed(t.inertia + h * w.turning_damping + h * h * w.turning_stiffness, twist, t.max_spin);
  for (int a = 0; a < 3; ++a) {
    w.right[a] = push[a];
    w.right[3 + a] = twist[a];
  }
}

RigidState moved_tool(const RigidState& s, const ToolWork& w, double h) {
  RigidState out = s;
  out.velocity = {w.solution[0], w.solution[1], w.solution[2]};
  out.spin = {w.solution[3], w.solution[4], w.solution[5]};
  out.position = s.position + h * out.velocity;
  const Mat3 moved = product(turn(h * out.spin), s.axes);
  Vec3 x = normalized(moved.c[0]), y = moved.c[1];
  y = normalized(y - dot(x, y) * x);
  out.axes.c = {x, y, cross(x, y)};
  return out;
}

void forces_on_tool(const RigidTool& t, const ToolWork& w, double h, RigidToolResult& out) {
  const Vec3 v{w.solution[0], w.solution[1], w.solution[2]}, spin{w.solution[3], w.solution[4], w.solution[5]};
  out.force = t.force + (1 / h) * Vec3{w.contact[0], w.contact[1], w.contact[2]};
  out.torque = t.torque + (1 / h) * Vec3{w.contact[3], w.contact[4], w.contact[5]};
  // Its limits, and what the solver left undone, are in it.
  out.coupling_force = (t.mass / h) * (v - w.velocity) - out.force;
  out.coupling_torque = (t.inertia / h) * (spin - w.spin) - out.torque;
}

}  // namespace kerf
