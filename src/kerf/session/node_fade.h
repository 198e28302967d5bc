// What nodes would jump by where a cut gives them another motion: an offset in place and in velocity that is added wherever the surface
// is shown, and fades like a critically damped spring. Mechanics knows nothing of it.
#pragma once

#include <vector>

#include "kerf/lattice/hex_mesh.h"
#include "kerf/mechanics/step.h"

namespace kerf {

/// Rate of the fading, 1/s: a tenth is left after 20 ms, a thousandth after 50.
inline constexpr double kFadeRate = 200;

/// One step of dt (s) of what fades: m, m/s.
struct FadeStep {
  double dt = 0, decay = 1;  ///< exp(-kFadeRate dt)
  explicit FadeStep(double step);
  void operator()(Vec3& offset, Vec3& velocity) const {
    const Vec3 rate = velocity + kFadeRate * offset;
    offset = decay * (offset + dt * rate);
    velocity = decay * rate - kFadeRate * offset;
  }
};
/// Is nothing left that could be seen? negligible: m.
bool faded(Vec3 offset, Vec3 velocity, double negligible);

/// By NodeId, in parallel; nodes beyond the end have none. Empty when none has.
struct NodeFade {
  std::vector<Vec3> offset, velocity;  ///< m, m/s

  [[nodiscard]] bool empty() const { return offset.empty(); }
  [[nodiscard]] Vec3 offset_of(NodeId n) const { return n.index() < offset.size() ? offset[n.index()] : Vec3{}; }
  [[nodiscard]] Vec3 velocity_of(NodeId n) const { return n.index() < velocity.size() ? velocity[n.index()] : Vec3{}; }
  void set(NodeId n, Vec3 new_offset, Vec3 new_velocity);
  void truncate(std::size_t nodes);
};

/// Where a node was and how it moved, metres and m/s; what it was shown with in addition.
struct NodeMotion {
  NodeId node;
  Vec3 position, velocity, offset, offset_velocity;
  [[nodiscard]] Vec3 shown_position() const { return position + offset; }
  [[nodiscard]] Vec3 shown_velocity() const { return velocity + offset_velocity; }
};

NodeMotion motion_of(const MechanicsState& state, const NodeFade& fade, NodeId node);

/// Gives a node another motion, offset included, and appends the old one to `old`, if they differ.
void move_node(NodeId node, const NodeMotion& to, MechanicsState& state, NodeFade& fade, std::vector<NodeMotion>& old);

/// Node positions or velocities (|N|) with their offsets: what is shown.
void add_offsets(std::span<const Vec3> values, std::span<const Vec3> offsets, std::vector<Vec3>& out);

}  // namespace kerf
