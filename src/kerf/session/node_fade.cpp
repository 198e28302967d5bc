#include "kerf/session/node_fade.h"

#include <algorithm>
#include <cmath>

namespace kerf {

FadeStep::FadeStep(double step) : dt(step), decay(std::exp(-kFadeRate * step)) {}

bool faded(Vec3 offset, Vec3 velocity, double negligible) {
  return norm(offset) + norm(velocity) / kFadeRate < negligible;
}

void NodeFade::set(NodeId n, Vec3 new_offset, Vec3 new_velocity) {
  if (n.index() >= offset.size()) {
    if (new_offset == Vec3{} && new_velocity == Vec3{}) return;
    offset.resize(n.index() + 1);
    velocity.resize(n.index() + 1);
  }
  offset[n.index()] = new_offset;
  velocity[n.index()] = new_velocity;
}

void NodeFade::truncate(std::size_t nodes) {
  if (nodes >= offset.size()) return;
  offset.resize(nodes);
  velocity.resize(nodes);
}

NodeMotion motion_of(const MechanicsState& state, const NodeFade& fade, NodeId node) {
  return {node, state.positions[node.index()], state.velocities[node.index()], fade.offset_of(node),
          fade.velocity_of(node)};
}

void move_node(NodeId node, const NodeMotion& to, MechanicsState& state, NodeFade& fade, std::vector<NodeMotion>& old) {
  const NodeMotion was = motion_of(state, fade, node);
  if (was.position == to.position && was.velocity == to.velocity && was.offset == to.offset &&
      was.offset_velocity == to.offset_velocity)
    return;
  old.push_back(was);
  state.positions[node.index()] = to.position;
  state.velocities[node.index()] = to.velocity;
  fade.set(node, to.offset, to.offset_velocity);
}

void add_offsets(std::span<const Vec3> values, std::span<const Vec3> offsets, std::vector<Vec3>& out) {
  out.assign(values.begin(), values.end());
  for (std::size_t i = 0; i < std::min(values.size(), offsets.size()); ++i) out[i] += offsets[i];
}

}  // namespace kerf
