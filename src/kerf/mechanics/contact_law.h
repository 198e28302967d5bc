// What a contact row pushes with, as a law of how it moves: one-sided spring, friction spring, what gives way at a limit.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "kerf/base/lanes.h"
#include "kerf/mechanics/contact_response.h"
#include "kerf/mechanics/step.h"

namespace kerf::contact_law {

using Row = ContactWork::Row;

/// A spring of friction is stretched by this part of options.unseen before it slips, however little it holds. Where next to nothing presses, k would have it
/// slip after nanometres, and what the solver leaves undone would decide, anew in every pass, who holds.
inline constexpr double kSlack = 0.1;

inline Vec3 vec_of(const Lanes& v) { return {v[0], v[1], v[2]}; }
inline Lanes lanes_of(Vec3 v) { return Lanes{v.x, v.y, v.z, 0}; }

/// Block, as Row::block, times a velocity.
inline Vec3 times(const double* block, Vec3 u) {
  return {block[0] * u.x + block[3] * u.y + block[5] * u.z, block[3] * u.x + block[1] * u.y + block[4] * u.z,
          block[5] * u.x + block[4] * u.y + block[2] * u.z};
}

using ToolVector = double (ToolWork::*)[6];

inline Vec3 tool_velocity(const double (&v)[6], Vec3 arm) {
  return Vec3{v[0], v[1], v[2]} + cross({v[3], v[4], v[5]}, arm);
}

/// J p of a row's nodes. Two sums, so that one need not wait for the other.
inline Lanes sum_of_nodes(const ContactSet& set, const ContactRow& row, const std::vector<StepWorkspace::Quad>& p) {
  Lanes even = all_lanes(0), odd = all_lanes(0);
  const ContactEntry* e = set.entries.data() + row.first;
  std::int32_t k = 0;
  for (; k + 1 < row.count; k += 2) {
    even += e[k].weight * load_lanes(p[e[k].node.index()].v);
    odd += e[k + 1].weight * load_lanes(p[e[k + 1].node.index()].v);
  }
  if (k < row.count) even += e[k].weight * load_lanes(p[e[k].node.index()].v);
  return even + odd;
}

/// J p of a row.
inline Vec3 relative(const ContactSet& set, const ContactRow& row, const std::vector<StepWorkspace::Quad>& p,
                     const std::vector<ToolWork>& tools, ToolVector tool_part) {
  Vec3 out = vec_of(sum_of_nodes(set, row, p));
  if (row.rigid >= 0) out -= tool_velocity(tools[row.rigid].*tool_part, row.arm);
  return out;
}

/// N along the normal at a gap, of a row that gives way.
inline double limited_force(const ContactRow& in, const Row& row, double gap) {
  return std::clamp(-row.stiffness * gap, 0.0, in.limit);
}

/// How far a friction spring is stretched when it slips, m, and its stiffness, N/m, where `limit` N are the most that it holds.
inline double longest_stretch(const ContactSet& set, const Row& row, double limit) {
  return std::max(kSlack * set.options.unseen, limit / row.stiffness);
}
inline double friction_stiffness(const ContactSet& set, const Row& row, double limit) {
  const double slack = kSlack * set.options.unseen;
  return slack > 0 ? std::min(row.stiffness, limit / slack) : row.stiffness;
}

/// N s, what a row gives to its nodes where they move relative to it with `motion` (J v), m/s, in a step of h. Friction is that of the present pass, with its limit: a row that
/// is open in it has none.
inline Vec3 impulse_at(const ContactSet& set, const ContactRow& in, const Row& row, double h, Vec3 motion) {
  const Vec3 u = motion - in.other_velocity;
  const double gap = row.gap + h * dot(in.normal, u);
  if (in.limit > 0) return (h * limited_force(in, row, gap)) * in.normal;
  const Vec3 pressing = std::max(0.0, -row.stiffness * gap) * in.normal;
  if (row.phase == ContactPhase::kOpen) return h * pressing;
  const Vec3 stretch = row.slip + h * (u - dot(u, in.normal) * in.normal);
  const double limit = in.friction * row.held, length = norm(stretch);
  const bool slips = length > longest_stretch(set, row, limit);
  return h * (pressing - (slips ? limit / length : friction_stiffness(set, row, limit)) * stretch);
}
/// N s, the same as the present pass has it, linearised.
inline Vec3 linear_impulse_at(const Row& row, Vec3 motion) {
  return row.phase == ContactPhase::kOpen ? Vec3{} : row.impulse - times(row.block, motion);
}

}  // namespace kerf::contact_law
