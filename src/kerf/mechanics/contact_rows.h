// What touches, as the time step sees it: weighted sums of nodes that must not pass a plane, with friction, and rigid
// tools with freedoms of their own. Mechanics knows no geometry; whoever detects contacts fills this in anew before
// every step.
#pragma once

#include <cstdint>
#include <vector>

#include "kerf/base/ids.h"
#include "kerf/base/vec.h"
#include "kerf/mechanics/rigid_state.h"

namespace kerf {

/// One node's share of a contact's relative motion. A node appears once in a row.
struct ContactEntry {
  NodeId node;
  double weight = 0;  ///< the body's own side sums to 1, another point of a body (self-contact) to -1
};

/// One point that touches, or might by the end of the step. Relative velocity (first side minus the other):
///   u = sum w v  -  other_velocity  -  [rigid >= 0: v_r + w_r x arm]
/// and the gap at the end of a step of h seconds is gap + h normal . u.
struct ContactRow {
  std::uint64_t key = 0;  ///< who touches whom; unique, rows come sorted by it; memory follows it from step to step
  std::int32_t first = 0, count = 0;  ///< its entries
  HexId cell;               ///< when all entries are the 8 corners of this element, in its order; else invalid
  std::int32_t rigid = -1;  ///< the other side is this rigid tool; -1: a place that moves as given, or nodes
  Vec3 arm;                 ///< from the tool's centre to the contact point, m
  Vec3 normal;              ///< unit, points from the other side to the first
  double gap = 0;           ///< at the start of the step, m; negative: overlap
  Vec3 other_velocity;      ///< of a given other side at the contact point, m/s
  double friction = 0;      ///< Coulomb's coefficient
  double push_speed = 0;    ///< m/s, instead of the options' where that is faster; 0: theirs
  double limit = 0;         ///< N: where it gives way, without friction and however deep it then is; 0: it never does
  double stiffness = 0;     ///< N/m, of a row with a limit, and only there
};

/// A rigid tool that follows a given pose through a virtual coupling: six freedoms in the same linear system.
struct RigidTool {
  double mass = 0.05;            ///< kg, of the proxy
  double inertia = 1e-5;         ///< kg m2, about any axis
  double stiffness = 0;          ///< N/m between the proxy and the pose it follows
  double damping = 0;            ///< N s/m
  double turning_stiffness = 0;  ///< N m/rad
  double turning_damping = 0;    ///< N m s/rad
  Vec3 target;                   ///< where the device is at the end of the step, m
  Mat3 target_axes;              ///< and how it is turned
  Vec3 target_velocity;          ///< m/s
  Vec3 target_spin;              ///< rad/s, world
  Vec3 force, torque;            ///< given ones on top of coupling and contacts, N, N m, world
  double max_force = 0;          ///< N the coupling can pull with; 0: no limit
  double max_torque = 0;         ///< N m the coupling can turn with; 0: no limit
  double max_speed = 10;         ///< m/s; poses that jump are followed at this speed
  double max_spin = 30;          ///< rad/s, the same for turns
};

/// What a contact remembers: its force and the stretch of its friction spring. Part of the state.
struct ContactMemory {
  std::uint64_t key = 0;
  double force = 0;  ///< normal, N
  Vec3 slip;         ///< m, tangential
  friend bool operator==(const ContactMemory&, const ContactMemory&) = default;
};

struct ContactOptions {
  double stiffness = 30;        ///< times the local diagonal of M / dt^2 + K
  int passes = 8;               ///< linear solves a step while contacts open and close; three times as many at most
  double friction_blend = 0.3;  ///< share of the secant in the sliding tangent
  double push_speed = 1;        ///< m/s at which bodies that overlap at the start are pushed apart
  double unseen = 0;  ///< m of new overlap without a force that end the passes all the same; 0: only forces count
};

/// All that touches in one step.
struct ContactSet {
  std::vector<ContactRow> rows;
  std::vector<ContactEntry> entries;
  std::vector<RigidTool> tools;  ///< as many as the state has
  ContactOptions options;
};

/// What a step did with a tool: N, N m about its centre, world. Their sum is mass times acceleration, to rounding.
struct RigidToolResult {
  Vec3 force, torque;  ///< on the tool: of all contacts, as the other sides feel them, and those given
  Vec3 coupling_force,
      coupling_torque;  ///< of the virtual coupling, with its limits, and with what the solver left undone
};

/// What a step did with one row.
struct ContactResult {
  double normal_force = 0;  ///< N, >= 0
  Vec3 force;               ///< on the first side, friction included, N
  double end_gap = 0;       ///< m
  bool sliding = false;
};

}  // namespace kerf
