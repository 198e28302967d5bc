// Contact in the session: a step of mechanics, in as many parts as fast tools want, with what touches found before each.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kerf/base/stopwatch.h"
#include "kerf/contact/sunk_walls.h"
#include "kerf/session/session_impl.h"
#include "kerf/session/tolerances.h"

namespace kerf {
namespace {

/// Points of a body that come together move by at most this part of their half thicknesses in a part of a step: faster, and
/// layers of a pile are through each other before they are seen. Radii count at least as this part of the body's largest.
constexpr double kSelfTravel = 0.25, kLeastRadius = 0.1;
/// And by this part where they meet an obstacle or a tool: they are held where it is as the part begins, which says little of how the body will have wrapped round it by the end.
constexpr double kObstacleTravel = 0.5;

/// A part of a step in which points of bodies got deeper into each other than this share of the largest half thickness, by half of it in that part, is
/// taken again in so many shorter ones.
constexpr double kDeeper = 0.03;
constexpr int kTryAgainParts = 4;

/// Those parts, and such as have turned, may be taken again in turn: so often at most.
constexpr int kTries = 2;

/// The second time where something has got deeper than kMostUnseen by surprise; but not into parts shorter than `substeps` allows
/// (but for rounding), and nothing is tried again for its depth once there are as many parts as it allows.
constexpr double kMostUnseen = 0.045, kShortest = 0.99;

/// Change of the deformation gradient in one part of a step at most (1: a turn of 0.7 radians), and parts at most. Rotations are frozen in a
/// part; what turns farther, such as a scrap that spins in a long step, would be fed with energy until it explodes.
constexpr double kMostTurn = 1, kTurnParts = 16;

/// Parts are divided in turn: for edges of tools, for what is fast or turns, for what comes together, for what got deep. All of that together could come to thousands, so
/// no part is shorter than what one of these divisions makes of a step, over this.
constexpr double kDivided = 4;

/// Ends of an edge of the body that come apart by more than the body's size in the shortest part of one division have nothing to do with each other any more.
constexpr double kTornApart = 1;

}  // namespace

double Session::Impl::shortest_part() const {
  return step_options.dt / (kDivided * std::max(kTurnParts, static_cast<double>(scene.contact.substeps)));
}

int Session::Impl::most_parts(double h) const {
  return std::max(1, static_cast<int>(h / (kShortest * shortest_part())));
}

Status Session::Impl::can_be_followed(double h) const {
  const double dt = step_options.dt;
  constexpr const char* kWhatToDo =
      "the step was refused and the state kept; try a shorter time step, or look for a load, a gravity, a move or a stiffness (young) that is out of scale";
  if (contact.seen.out_of_range)
    return failed(
        fmt::format("the body, an obstacle or a tool is or gets farther away than {:.0e} m in a time step of {} s; {}",
                    kFarthest, dt, kWhatToDo));
  const double part = std::min(h, kDivided * shortest_part()), most = kTornApart * size * (h / part);
  if (!(2 * contact.seen.sway > most)) return {};
  double apart = 0;
  const ContactSurface& mesh = contact.surface;
  const auto way = [&](CollisionVertex v) { return contact.predicted[v.index()] - contact.positions[v.index()]; };
  for (const CollisionHalfEdge e : ids<CollisionHalfEdge>(mesh.origin.size()))
    apart = std::max(apart, norm(way(mesh.to(e)) - way(mesh.from(e))));
  if (!(apart > most)) return {};
  return failed(fmt::format(
      "neighbouring points of the body come apart at {:.3g} m/s, too fast to be followed in a time step of {} s: by {:.3g} times the body's size in the shortest part that "
      "it is divided into; {}",
      apart / h, dt, kTornApart * apart / most, kWhatToDo));
}

int Session::Impl::parts_of_meeting(double h) const {
  double most = 1;
  const double least = contact.surface.largest_radius * kLeastRadius;
  for (std::size_t i = 0; i < contact.contacts.size(); ++i) {
    const Contact& c = contact.contacts[i];
    const ContactRow& row = contact.set.rows[i];
    if (row.limit > 0) continue;  // an edge that presses until it cuts
    Vec3 u = -row.other_velocity;
    if (row.rigid >= 0) {
      const auto& tool = state.mechanics.tools[static_cast<std::size_t>(row.rigid)];
      u -= tool.velocity + cross(tool.spin, row.arm);
    }
    for (std::int32_t k = row.first; k < row.first + row.count; ++k)
      u += contact.set.entries[k].weight * state.mechanics.velocities[contact.set.entries[k].node.index()];
    const double closing = -h * dot(row.normal, u), radius = contact.surface.radius[c.a.vertex[0]];
    if (c.b.vertex[0].valid()) {
      most = std::max(most, closing / (kSelfTravel * std::max(radius + contact.surface.radius[c.b.vertex[0]], least)));
      continue;
    }
    // What falls already falls faster in this part; what lies still a little above an obstacle is held by something else.
    const double comes =
        closing + std::clamp(-h * h * dot(row.normal, step_options.gravity), 0.0, std::max(closing, 0.0));
    if (comes > row.gap) most = std::max(most, comes / (kObstacleTravel * std::max(radius, least)));
  }
  return std::min(most_parts(h),
                  static_cast<int>(std::ceil(std::min(most, static_cast<double>(scene.contact.substeps)))));
}

int Session::Impl::parts_of_turning(double h) const {
  const double turn = h * deformation_rate(state.body.hex, state.mechanics.velocities, kMostTurn / h);
  return std::clamp(static_cast<int>(std::ceil(turn / kMostTurn < kTurnParts ? turn / kMostTurn : kTurnParts)), 1,
                    most_parts(h));
}

int Session::Impl::parts_of_turned(double h) const {
  const double turned = h * deformation_rate(state.body.hex, state.mechanics.velocities, kMostTurned / h);
  return turned > kMostTurned ? parts_of_turning(h) : 1;
}

bool Session::Impl::went_too_deep() const {
  const double most = kDeeper * contact.surface.largest_radius;
  for (std::size_t i = 0; i < contact.contacts.size(); ++i) {
    const double gap = contact.set.rows[i].gap, end = workspace.contact.results[i].end_gap;
    if (contact.contacts[i].b.vertex[0].valid() && end < -most && end < gap - 0.5 * most) return true;
  }
  return false;
}

bool Session::Impl::must_try_again(int tries, double h, const MechanicsState& began) {
  if (tries == kTries && went_too_deep()) return true;
  const double deep = (tries < kTries ? kMostUnseen : kDeeper) * contact.surface.largest_radius;
  return find_surprise(scene, state.body, state.model, began, state.mechanics, touched_part, h, step_options.gravity,
                       deep, workspace.contact.results, contact);
}

Result<StepReport> Session::Impl::divide_part(double t, double h, int more, int tries, const MechanicsState* began) {
  StepReport sum;
  for (int i = 0; i < more; ++i) {
    if (tries > 0 && i > 0) {
      MechanicsState& now = before_part[static_cast<std::size_t>(tries - 1)];
      now = state.mechanics;
      began = &now;
    }
    auto part = advance_part(t + i * (h / more), h / more, kUndivided, tries, began);
    if (!part) return part;
    add_part(*part, sum, i == 0);
  }
  parts += more - 1;
  return sum;
}

Result<StepReport> Session::Impl::advance_part(double t, double h, int least_parts, int tries,
                                               const MechanicsState* began) {
  int more = std::max(1, least_parts);
  touched_part = state.touching;
  if (contact.on) {
    const auto start = Clock::now();
    passing.clear();
    find_contacts(scene, state.body, state.model, state.mechanics, state.tools, t, h, step_options.gravity,
                  state.touching, contact, [this](const Contact& c) { return is_bonded(c) || lets_pass(c); });
    add_edge_rows(state.body, state.mechanics, edge_presses, contact);
    state.touching.passing = passing;
    detection_seconds += seconds_since(start);
    KERF_TRY(can_be_followed(h));
    if (least_parts != kUndivided) more = std::max(more, parts_of_meeting(h));
    if (more > 1) state.touching = touched_part;
  }
  if (more > 1) return divide_part(t, h, more, tries, began);
  last_options = step_options;
  last_options.dt = h;
  last_options.part_of = step_options.dt;
  if (contact.on &&
      (std::any_of(contact.contacts.begin(), contact.contacts.end(),
                   [](const Contact& c) { return c.b.vertex[0].valid(); }) ||
       std::any_of(state.tools.begin(), state.tools.end(), [](const ToolMotion& m) { return m.is_between_lips(); })))
    last_options.tolerance *= kPairTolerance;
  aim_holds(t + h);
  const double fastest = fastest_node(state.model, state.mechanics);
  auto done = kerf::step(state.model, state.mechanics, last_options, workspace, contact.on ? &contact.set : nullptr);
  if (!done) return done;
  if (const int again = tries > 0 ? parts_of_turned(h) : 1; again > 1) {
    state.mechanics = *began;
    state.touching = touched_part;
    return divide_part(t, h, again, tries - 1, began);
  }
  if (contact.on) {
    contact.sunk.clear();
    remember_gaps(workspace.contact.results, contact, state.touching);
    done->deepest_overlap = reckon_overlap(state.body, state.mechanics, kDeeper * contact.surface.largest_radius,
                                           workspace.contact.results, contact);
    if (tries > 0 && parts < scene.contact.substeps && most_parts(h) >= kTryAgainParts &&
        must_try_again(tries, h, *began)) {
      state.mechanics = *began;
      state.touching = touched_part;
      remember_sunk_walls(contact.surface, contact.sunk, state.touching);
      const bool once_more = tries > 1 && h / kTryAgainParts > kShortest * step_options.dt / scene.contact.substeps;
      return divide_part(t, h, kTryAgainParts, once_more ? tries - 1 : 0, began);
    }
    remember_sunk_walls(contact.surface, contact.sunk, state.touching);
  }
  // The solver settles slivers too (kNodeTolerance, carry_crumbs). Few random lives have been tried without this.
  calm_light_nodes(state.body.hex, state.model.structure().mass, h, state.mechanics);
  cap_part(h, fastest, *done);
  add_forces(workspace.contact.tool_results, h, part_impulses);
  return done;
}

void Session::Impl::cap_part(double h, double fastest, StepReport& report) {
  double reached = fastest;
  for (const std::vector<RigidShape>* shapes : {&contact.shapes.obstacles, &contact.tools})
    for (const RigidShape& shape : *shapes) reached = std::max(reached, greatest_speed(shape));
  std::span<const std::uint8_t> touched;
  if (contact.on) touched = workspace.contact.touched_free;
  const SlowedNodes slowed =
      cap_speeds(state.model, {kDivided * shortest_part(), reached}, touched, h, state.mechanics, speed_cap);
  report.slowed_nodes = slowed.count;
  report.fastest_slowed = slowed.fastest;
}

void Session::Impl::hold_in_contact() {
  if (contact_held_at == state.topology_version) return;
  if (contact_held_at == 0) {  // what is held may have changed
    const HeldRegions& held = state.materials.held;
    kerf::hold_sides(held.cross ? [held](Vec3 rest) { return held.contains(rest); } : std::function<bool(Vec3)>(),
                     contact);
  }
  kerf::hold_in_contact(state.body, held_collision(), contact);
  contact_held_at = state.topology_version;
}

Result<StepReport> Session::Impl::advance_mechanics(double dt) {
  KERF_TRY(fresh_springs());
  part_impulses.assign(scene.tools.size(), {});
  if (contact.on) hold_in_contact();
  int equal =
      contact.on ? contact_substeps(scene, state.body, state.mechanics, state.tools, state.time, dt, contact) : 1;
  equal = std::min(std::max(equal, parts_of_turning(dt)), most_parts(dt));
  parts = equal;
  before_step = state.mechanics;
  touched_before = state.touching;
  state.model.refresh();
  const double h = dt / equal;
  StepReport sum;
  for (int i = 0; i < equal; ++i) {
    const MechanicsState* began = &before_step;
    if (i > 0) {
      before_part.back() = state.mechanics;
      began = &before_part.back();
    }
    // What it turns is known for the first of one part.
    auto part = advance_part(state.time + i * h, h, equal == 1 ? 1 : parts_of_turning(h), kTries, began);
    if (!part) {
      state.mechanics = before_step;
      state.touching = touched_before;
      return part;
    }
    add_part(*part, sum, i == 0);
    if (i == 0 && state.steps == 0) warn_of_overlap();
  }
  return sum;
}

void Session::Impl::warn_of_overlap() {
  if (!contact.on || contact.seen.deep == 0) return;
  add_note(fmt::format(
      "things start inside each other: {} contacts deeper than a fifth of the half thickness, the deepest {:.2g} of it; they are "
      "pushed apart at up to {} m/s (push_speed of [contact]), and what is free keeps that speed and flies off with it: place things apart, or lower push_speed",
      contact.seen.deep, contact.seen.deepest, scene.contact.push_speed));
}

void Session::Impl::contact_follows(std::span<const CollisionTriangle> changed) {
  state.touching.cut = !state.touching.contacts.empty();
  contact.sides_stale = true;
  if (!contact.on || contact.surface_stale) {
    state.touching.walls.clear();
    return;
  }
  update_contact_surface(state.body.complex.collision, changed, contact.surface);
  forget_sunk_walls(contact.surface, changed, state.touching);
}

std::vector<Session::ContactState> Session::contacts() const {
  const Impl& s = *impl_;
  std::vector<ContactState> out;
  const std::vector<ContactResult>& results = s.workspace.contact.results;
  // What the last step left belongs to the body that there was then.
  if (!s.contact.on || s.forces_of != s.state.topology_version || results.size() != s.contact.set.rows.size())
    return out;
  out.reserve(s.contact.contacts.size());
  for (std::size_t i = 0; i < s.contact.contacts.size(); ++i) {
    const Contact& c = s.contact.contacts[i];
    const ContactResult& r = results[i];
    out.push_back({c.point, c.normal, r.end_gap, r.force, r.normal_force, r.sliding, c.obstacle, c.tool});
  }
  return out;
}

std::vector<Session::ToolState> Session::tools() const {
  const Impl& s = *impl_;
  std::vector<ToolState> out;
  // What the last step left belongs to the body that there was then.
  const bool felt = s.forces_of == s.state.topology_version && s.tool_forces.size() == s.state.mechanics.tools.size();
  for (std::size_t i = 0; i < s.state.mechanics.tools.size(); ++i) {
    ToolState tool;
    tool.place = s.state.mechanics.tools[i];
    tool.jaws = s.state.tools[i].jaws(s.state.time);
    tool.pose = s.state.tools[i].pose(s.state.time);
    if (felt) {
      const RigidToolResult& on = s.tool_forces[i];
      tool.force = on.force;
      tool.torque = on.torque;
      tool.coupling_force = on.coupling_force;
      tool.coupling_torque = on.coupling_torque;
    }
    out.push_back(tool);
  }
  return out;
}

}  // namespace kerf
