// A step of the session: tools cut where they have got to, the body moves, the tools feel what they have met. All of that in shorter parts
// where an edge is fast in the material, so that neither goes through the other between two looks.
#include <algorithm>
#include <cmath>

#include "kerf/session/session_impl.h"
#include "kerf/spatial/triangle_queries.h"

namespace kerf {
namespace {

/// Half thicknesses that material may move past an edge in a part of a step.
constexpr double kEdgeTravel = 1;
/// The same for what nobody could have known: a part in which it was more is taken again in so many shorter ones.
constexpr double kEdgeSurprise = 2;
constexpr int kTryPieceAgain = 4;
/// Of the body's size: offsets of surface vertices that are dropped.
constexpr double kFaded = 1e-9;

}  // namespace

void Session::Impl::add_part(const StepReport& part, StepReport& sum, bool first) {
  const StepReport before = sum;
  sum = part;
  if (first) return;
  sum.iterations += before.iterations;
  sum.block_jacobi_iterations += before.block_jacobi_iterations;
  sum.passes = std::max(part.passes, before.passes);
  sum.cap_hit = part.cap_hit || before.cap_hit;
  sum.factorised = part.factorised || before.factorised;
  sum.two_level = part.two_level || before.two_level;
  sum.deepest_overlap = std::max(part.deepest_overlap, before.deepest_overlap);
  sum.slowed_nodes += before.slowed_nodes;
  sum.fastest_slowed = std::max(part.fastest_slowed, before.fastest_slowed);
  sum.seconds_forces += before.seconds_forces;
  sum.seconds_setup += before.seconds_setup;
  sum.seconds_solve += before.seconds_solve;
  sum.seconds_contact += before.seconds_contact;
  sum.seconds_total += before.seconds_total;
}

void Session::Impl::add_forces(std::span<const RigidToolResult> forces, double times,
                               std::vector<RigidToolResult>& sum) {
  for (std::size_t i = 0; i < std::min(forces.size(), sum.size()); ++i) {
    sum[i].force += times * forces[i].force;
    sum[i].torque += times * forces[i].torque;
    sum[i].coupling_force += times * forces[i].coupling_force;
    sum[i].coupling_torque += times * forces[i].coupling_torque;
  }
}

namespace {

/// An edge of a tool and how it moves.
struct MovingEdge {
  Vec3 base, tip;
  Vec3 base_way, tip_way;  ///< m, in the time looked at
};

/// m that what hangs on a collision vertex and an edge move past each other, across the edge; 0 if it is too far off for that. `between`: how far from
/// a vertex there may be material.
double way_past(const MovingEdge& edge, Vec3 x, Vec3 moves, double radius, double between) {
  const double length = norm(edge.tip - edge.base);
  if (!(length > 0)) return 0;
  const Vec3 along = (1 / length) * (edge.tip - edge.base);
  Vec3 u = moves - lerp(edge.base_way, edge.tip_way, std::clamp(dot(x - edge.base, along) / length, 0.0, 1.0));
  u -= dot(u, along) * along;
  const double way = norm(u);
  return distance_to_segment(x, edge.base, edge.tip) <= way + radius + between ? way : 0;
}

}  // namespace

bool Session::Impl::edge_at_work(std::size_t i) const {
  return has_edge(scene.tools[i]) && (!state.stroke || state.stroke->tool == static_cast<std::int32_t>(i));
}

double Session::Impl::edge_travel(double dt) {
  double most = 0;
  for (std::size_t i = 0; i < scene.tools.size(); ++i) {
    if (!edge_at_work(i)) continue;
    const RigidState& at = state.mechanics.tools[i];
    const auto [velocity, spin] = expected_velocity(scene.tools[i], state.tools[i], at, state.time, dt);
    const ToolEdge edge = tool_edge(scene.tools[i], state.tools[i].jaws(state.time));
    const RigidPlace place{at.position, at.axes};
    MovingEdge moving{place.to_world(edge.base), place.to_world(edge.tip), {}, {}};
    moving.base_way = dt * (velocity + cross(spin, moving.base - at.position));
    moving.tip_way = dt * (velocity + cross(spin, moving.tip - at.position));
    const CollisionMesh& mesh = state.body.complex.collision;
    const std::vector<Vec3>& positions = deformed_collision();
    const double between = state.body.complex.mean_root_edge;
    double fastest = 0;  // no vertex moves faster than the fastest node
    for (const Vec3& v : state.mechanics.velocities) fastest = std::max(fastest, dot(v, v));
    const double reach = dt * std::sqrt(fastest) + std::max(norm(moving.base_way), norm(moving.tip_way)) + between;
    for (const CollisionVertex v : ids<CollisionVertex>(positions.size())) {
      const Vec3 x = positions[v.index()];
      const double radius = norm(mesh.offset[v]);
      if (!(radius > 0) || distance_to_segment(x, moving.base, moving.tip) > reach + radius) continue;
      const Embedding& e = state.body.embedding;
      const Vec3 moves =
          dt * point_position(state.body.hex, {e.collision[v], e.collision_local[v]}, state.mechanics.velocities);
      most = std::max(most, way_past(moving, x, moves, radius, between) / radius);
    }
  }
  return most;
}

double Session::Impl::edge_travelled() {
  double most = 0;
  for (std::size_t i = 0; i < scene.tools.size(); ++i) {
    // The line where the blades of scissors meet runs along itself.
    if (!edge_at_work(i) || scene.tools[i].kind == SceneToolKind::kScissors) continue;
    const ToolEdge edge = tool_edge(scene.tools[i], state.tools[i].jaws(state.time));
    const RigidState &was = before_step.tools[i], &is = state.mechanics.tools[i];
    const RigidPlace from{was.position, was.axes}, to{is.position, is.axes};
    const Vec3 base = from.to_world(edge.base), tip = from.to_world(edge.tip);
    const MovingEdge moving{base, tip, to.to_world(edge.base) - base, to.to_world(edge.tip) - tip};
    const CollisionMesh& mesh = state.body.complex.collision;
    const std::vector<Vec3>& positions = deformed_collision();
    for (const CollisionVertex v : ids<CollisionVertex>(positions.size())) {
      const Vec3 x = state.seen[v.index()];
      const double radius = norm(mesh.offset[v]);
      if (radius > 0)
        most = std::max(
            most, way_past(moving, x, positions[v.index()] - x, radius, state.body.complex.mean_root_edge) / radius);
    }
  }
  return most;
}

Result<StepReport> Session::Impl::advance_tools_and_body(double h, bool tools_first, bool may_divide) {
  if (tools_first) KERF_TRY(use_tools(state.time + h));
  renew_loads();
  auto done = advance_mechanics(h);
  if (!done) return done;
  positions_changed();
  // What a cut has let go springs off faster than anybody could have known.
  if (may_divide && contact.on && edge_travelled() > kEdgeSurprise) {
    state.mechanics = before_step;
    state.touching = touched_before;
    positions_changed();
    return divide_tools_and_body(h, kTryPieceAgain, false);
  }
  feel_tools();
  press_edges();
  carry_unused_nodes(state.body.hex, state.model, state.mechanics, carried);
  fade_offsets(state.fade, h, kFaded * size);
  positions_changed();
  add_forces(part_impulses, 1, step_impulses);
  return done;
}

Result<StepReport> Session::Impl::divide_tools_and_body(double dt, int equal, bool tools_first) {
  const double began = state.time;
  StepReport sum;
  int all = 0;
  for (int i = 0; i < equal; ++i) {
    state.time = began + i * (dt / equal);
    auto part = advance_tools_and_body(dt / equal, tools_first || i > 0, tools_first && scene.contact.substeps > 1);
    state.time = began;
    if (!part) return part;
    add_part(*part, sum, i == 0);
    all += parts;
  }
  parts = all;
  return sum;
}

Result<StepReport> Session::Impl::advance() {
  const double dt = step_options.dt, travel = scene.contact.substeps > 1 ? edge_travel(dt) / kEdgeTravel : 1;
  detection_seconds = 0;
  step_impulses.assign(scene.tools.size(), {});
  auto done = divide_tools_and_body(
      dt, static_cast<int>(std::ceil(std::clamp(travel, 1.0, static_cast<double>(scene.contact.substeps)))), true);
  if (!done) return done;
  tool_forces.assign(scene.tools.size(), {});
  add_forces(step_impulses, 1 / dt, tool_forces);
  for (const RigidToolResult& tool : tool_forces)
    state.largest_tool_force = std::max(state.largest_tool_force, norm(tool.force));
  return done;
}

}  // namespace kerf
