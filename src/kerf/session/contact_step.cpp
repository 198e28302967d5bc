#include "kerf/session/contact_step.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "kerf/base/lanes.h"
#include "kerf/contact/rest_neighbours.h"
#include "kerf/contact/sunk_walls.h"
#include "kerf/contact/surface_offsets.h"
#include "kerf/lattice/tip_glue.h"
#include "kerf/mechanics/rigid_tools.h"
#include "kerf/spatial/segment_queries.h"

namespace kerf {
namespace {

/// A known contact that ends deeper than was solved for, by this part of what is too deep, has turned.
constexpr double kUnlike = 0.5;

/// Radius of gyration of a tool's proxy, m: turns of its tip weigh as much as moves.
constexpr double kToolGyration = 0.02;

/// Contacts give way by force over stiffness, which is that of cells: in bodies thinner than a cell by more than this, the stiffness
/// grows as they get thinner (up to the second times), so that the overlap stays as small a part of the half thickness.
constexpr double kThinCell = 5, kStiffest = 20;

/// Bodies that are in each other, or in themselves, come apart by at most so many half thicknesses a second: what turns out to overlap
/// without a force that held it (a sliver that spins between others) must not be thrown.
constexpr double kPushRadii = 20;

/// A cut runs this part of the mean collision edge beside the blade that makes it, at most: snapped to vertices, and straightened.
constexpr double kStray = 0.2;

/// Jaws turn by at most this part of the thickness of theirs and the body's in a part of a step, as all tools move (substeps()).
constexpr double kJawTravel = 0.5;

/// Contacts that a step closes without having seen them may overlap by this part of the half thickness.
constexpr double kUnseen = 0.01;

/// A wall that a step took into material came deeper by at least this part of what is too deep.
constexpr double kSankBy = 0.5;

DetectOptions detect_options(const Scene& scene, double h) {
  DetectOptions options;
  options.step = h;
  options.margin = scene.contact.margin;
  options.self_contact = scene.contact.self;
  options.body_friction = scene.contact.friction;
  return options;
}

/// Trilinear weights of the corners at local coordinates, z = -1 and z = +1.
struct CornerWeights {
  Lanes low, high;
};
CornerWeights corner_weights(Vec3 l) {
  const Lanes x{1 - l.x, 1 + l.x, 1 - l.x, 1 + l.x}, y{1 - l.y, 1 - l.y, 1 + l.y, 1 + l.y};
  const Lanes xy = 0.125 * (x * y);
  return {(1 - l.z) * xy, (1 + l.z) * xy};
}

Vec3 vec_of(const Lanes& v) { return {v[0], v[1], v[2]}; }

/// Where a node would be h seconds on without contact.
Vec3 predicted_place(const MechanicsModel& model, const MechanicsState& state, std::size_t i, double h, Vec3 gravity) {
  return state.positions[i] +
         h * (model.is_fixed(NodeId(i)) ? model.prescribed_velocities()[i] : state.velocities[i] + h * gravity);
}

/// The surface as it is and as it will be, by c.nodes: positions and offsets of its vertices in one pass, as collision_positions() and
/// surface_offsets() define them.
SurfaceState surface_state(const Body& body, ContactStep& c) {
  const std::size_t n = body.complex.collision.vertex_count();
  c.positions.resize(n);
  c.offsets.resize(n);
  c.predicted.resize(n);
  std::int32_t whose = -1;  // the body that these are of
  Mat3 axes;
  Vec3 per_cell;
  for (const CollisionVertex v : ids<CollisionVertex>(n)) {
    const std::int32_t its = body.hex.body_at(body.hex.cell[body.embedding.collision[v]]);
    if (its != whose) {
      const LatticeFrame& frame = body.hex.frame_of_body(its);
      whose = its;
      axes = frame.axes;
      per_cell = {2 / frame.cell.x, 2 / frame.cell.y, 2 / frame.cell.z};
    }
    const Vec3 l = body.embedding.collision_local[v], o = transposed_times(axes, c.surface.offset[v]);
    const Vec3 d{o.x * per_cell.x, o.y * per_cell.y, o.z * per_cell.z};
    const CornerWeights at = corner_weights(l), plus = corner_weights(l + d), minus = corner_weights(l - d);
    const Lanes lifted[2] = {0.5 * (plus.low - minus.low), 0.5 * (plus.high - minus.high)};
    const Lanes own[2] = {at.low, at.high};
    const auto& corner = body.hex.nodes[body.embedding.collision[v]];
    Lanes now = all_lanes(0), next = all_lanes(0), offset = all_lanes(0);
    for (std::size_t i = 0; i < 8; ++i) {
      const NodeState& node = c.nodes[corner[i].index()];
      const Lanes x = load_lanes(node.now);
      now += own[i / 4][i % 4] * x;
      next += own[i / 4][i % 4] * load_lanes(node.next);
      offset += lifted[i / 4][i % 4] * x;
    }
    c.positions[v.index()] = vec_of(now);
    c.predicted[v.index()] = vec_of(next);
    c.offsets[v.index()] = vec_of(offset);
  }
  for (const CollisionVertex v : ids<CollisionVertex>(c.sides.corner.size())) {
    if (!c.sides.corner[v][0].copy.valid()) continue;
    const CarriedPlace minus = place_of(body.hex, c.sides.corner[v][0], c.nodes),
                       plus = place_of(body.hex, c.sides.corner[v][1], c.nodes);
    c.positions[v.index()] = 0.5 * (minus.now + plus.now);
    c.predicted[v.index()] = 0.5 * (minus.next + plus.next);
    c.offsets[v.index()] = 0.5 * (plus.now - minus.now);
  }
  for (const CollisionVertex v : c.held) {
    c.positions[v.index()] = c.predicted[v.index()] = c.surface.rest[v];
    c.offsets[v.index()] = c.surface.offset[v];
  }
  return {&c.surface, c.positions, c.offsets, c.predicted};
}

/// The surface at rest where a state has it.
SurfaceState surface_at(const Body& body, const MechanicsState& state, ContactStep& c) {
  c.nodes.resize(state.positions.size());
  for (std::size_t i = 0; i < state.positions.size(); ++i) {
    const Vec3 x = state.positions[i];
    c.nodes[i] = {{x.x, x.y, x.z, 0}, {x.x, x.y, x.z, 0}};
  }
  return surface_state(body, c);
}

/// How the surface came to be elsewhere than detect_contacts() said: places, and offsets, which it took for fixed. Both are linear in the nodes.
Strayed find_strays(const Body& body, const MechanicsModel& model, const MechanicsState& began,
                    const MechanicsState& ended, double h, Vec3 gravity, ContactStep& c) {
  c.nodes.resize(ended.positions.size());
  for (std::size_t i = 0; i < ended.positions.size(); ++i) {
    const Vec3 moved = ended.positions[i] - began.positions[i],
               stray = ended.positions[i] - predicted_place(model, began, i, h, gravity);
    c.nodes[i] = {{moved.x, moved.y, moved.z, 0}, {stray.x, stray.y, stray.z, 0}};
  }
  surface_state(body, c);
  std::swap(c.strays, c.predicted);
  std::swap(c.turns, c.offsets);
  for (const CollisionVertex v : c.held) c.strays[v.index()] = c.turns[v.index()] = {};
  return {c.strays, c.turns};
}

/// Where two edges are nearest at their ends of the prism, if that is inside both.
bool find_feet(const SurfaceState& surface, SurfacePoint& a, SurfacePoint& b) {
  const auto corner = [&](const SurfacePoint& p, std::size_t k) {
    return surface.position[p.vertex[k].index()] + p.lift * surface.offset[p.vertex[k].index()];
  };
  SegmentFeet feet;
  if (!inner_feet(corner(a, 0), corner(a, 1), corner(b, 0), corner(b, 1), feet)) return false;
  a.weight = {1 - feet.s, feet.s, 0};
  b.weight = {1 - feet.t, feet.t, 0};
  return true;
}

/// How deep the points of a contact are in the material of the other one, m; of edges also those that are nearest now.
double depth_of(const SurfaceState& surface, const Contact& contact, DepthSearch& search) {
  double depth = std::max(kerf::depth_of(surface, contact.a, 0, search), kerf::depth_of(surface, contact.b, 0, search));
  SurfacePoint a = contact.a, b = contact.b;
  const bool edges = a.vertex[1].valid() && b.vertex[1].valid() && !a.vertex[2].valid() && !b.vertex[2].valid();
  if (!edges || !find_feet(surface, a, b)) return depth;
  return std::max({depth, kerf::depth_of(surface, a, 0, search), kerf::depth_of(surface, b, 0, search)});
}

/// Came walls over borders to be deeper than `deep` in material of the body, and by kSankBy of that since it began?
bool walls_sank_in(const Body& body, const MechanicsState& began, const MechanicsState& ended, double deep,
                   ContactStep& c) {
  const SurfaceState end = surface_at(body, ended, c);
  prepare_depths(end, c.depths);
  find_deep_walls(end, deep, c.depths);
  if (c.depths.deep.empty()) return false;
  c.sunk = c.depths.deep;
  const SurfaceState begin = surface_at(body, began, c);
  prepare_depths(begin, c.depths);
  return std::any_of(c.depths.deep.begin(), c.depths.deep.end(), [&](const DepthSearch::Deep& d) {
    return kerf::depth_of(begin, d.point, 0, c.depths) < d.depth - kSankBy * deep;
  });
}

/// Obstacles on their way, tools where they are with the velocity that they would have without contacts.
void place_shapes(const Scene& scene, const MechanicsState& state, const std::vector<ToolMotion>& motions, double t,
                  double h, ContactStep& c) {
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i)
    if (!scene.obstacles[i].moves.empty())
      place_shape(place_at(scene.obstacles[i], t), place_at(scene.obstacles[i], t + h), h, c.shapes.obstacles[i]);
  c.tools.resize(scene.tools.size());
  c.set.tools.resize(scene.tools.size());
  for (std::size_t i = 0; i < scene.tools.size(); ++i) {
    const SceneRigidTool& tool = scene.tools[i];
    RigidShape& shape = c.tools[i];
    const double jaws = motions[i].jaws(t + h);  // as they will be: their own motion is in the gaps
    if (shape.parts.empty() || motions[i].jaws(t) != jaws || motions[i].jaws_over > 0)
      shape.parts = tool_parts(tool, jaws, c.shapes.tool_meshes[i]);
    shape.friction = tool.friction.value_or(scene.contact.friction);
    const RigidState& now = state.tools[i];
    c.set.tools[i] = rigid_tool(tool, motions[i], t, h);
    c.set.tools[i].force = motions[i].force;
    c.set.tools[i].torque = motions[i].torque;
    const RigidVelocity expected = expected_velocity(tool, motions[i], now, t, h);
    shape.position = now.position;
    shape.axes = now.axes;
    shape.velocity = expected.linear;
    shape.spin = expected.spin;
  }
}

/// What carries a vertex, as a lip has it; no copy: a support holds it. A tip's cell is split ahead of it too, so what carries the tip follows one of its lips and not the other:
///
///         left lip
///     ------------___
///      blade >       o  the tip, as the left copy has it
///     ________----- o   and as the right one has it
///         right lip
EmbeddedPoint carrier_of(const Body& body, const ContactStep& c, CollisionVertex v, CollisionHalfEdge lip) {
  if (!c.held.empty() && c.is_held[v.index()] != 0) return {};
  const EmbeddedPoint own{body.embedding.collision[v], body.embedding.collision_local[v]};
  if (!lip.valid()) return own;
  const Vec3 rest = body.complex.collision.rest[v];
  const TipCopies tip = copies_of_lips(body.hex, v, rest);
  if (!tip.left.valid()) return own;
  const HexId copy = body.complex.collision.to(lip) == v ? tip.left : tip.right;
  return {copy, body.hex.local(copy, rest)};
}

/// Weights of a cell's corners in vertex v's place, displaced by lift times its offset (surface_offsets.h), four at a time.
CornerWeights weights_of(const Body& body, const ContactStep& c, CollisionVertex v, const EmbeddedPoint& carrier,
                         double lift) {
  const Vec3 local = carrier.local;
  CornerWeights w = corner_weights(local);
  if (lift == 0) return w;
  const LatticeFrame& frame = body.hex.frame_of(carrier.copy);
  const Vec3 o = transposed_times(frame.axes, c.surface.offset[v]);
  const Vec3 d{2 * o.x / frame.cell.x, 2 * o.y / frame.cell.y, 2 * o.z / frame.cell.z};
  const CornerWeights plus = corner_weights(local + d), minus = corner_weights(local - d);
  w.low += lift * (0.5 * (plus.low - minus.low));
  w.high += lift * (0.5 * (plus.high - minus.high));
  return w;
}

/// Adds entries of a copy's nodes, times a scale. Nodes that are there already get the sum.
void add_entries(const Body& body, HexId copy, const CornerWeights& w, double scale, std::int32_t first,
                 ContactStep& c) {
  auto& entries = c.set.entries;
  const Lanes weights[2] = {scale * w.low, scale * w.high};
  const auto& nodes = body.hex.nodes[copy];
  for (std::size_t i = 0; i < 8; ++i) {
    std::int32_t& slot = c.node_slot[nodes[i].index()];
    if (slot < first) {
      slot = static_cast<std::int32_t>(entries.size());
      entries.push_back({nodes[i], 0});
    }
    entries[static_cast<std::size_t>(slot)].weight += weights[i / 4][i % 4];
  }
}

/// The corners of the prism at a vertex, where other copies carry them than the one that carries the vertex; or null.
const std::array<EmbeddedPoint, 2>* carried_corners(const ContactStep& c, CollisionVertex v) {
  return c.sides.corner.contains(v) && c.sides.corner[v][0].copy.valid() ? &c.sides.corner[v] : nullptr;
}

/// Adds the entries of a surface point, on a lip or none, times sign. Returns what of that no node carries.
double add_point(const Body& body, const SurfacePoint& point, CollisionHalfEdge lip, double sign, std::int32_t first,
                 ContactStep& c) {
  double held = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const CollisionVertex v = point.vertex[k];
    if (!v.valid() || point.weight[k] == 0) continue;
    const EmbeddedPoint carrier = carrier_of(body, c, v, lip);
    const double scale = sign * point.weight[k];
    if (!carrier.copy.valid()) {
      held += scale;
      continue;
    }
    const auto* corner = carrier.copy == body.embedding.collision[v] ? carried_corners(c, v) : nullptr;
    if (corner == nullptr) {
      add_entries(body, carrier.copy, weights_of(body, c, v, carrier, point.lift), scale, first, c);
      continue;
    }
    for (std::size_t end = 0; end < 2; ++end)
      if (const double share = 0.5 * (end == 0 ? 1 - point.lift : 1 + point.lift); share != 0)
        add_entries(body, (*corner)[end].copy, corner_weights((*corner)[end].local), share * scale, first, c);
  }
  return held;
}

/// How far a lip can leave the one that faces it: 0 where one cell carries both, 1 where they have no node in common.
double freedom(const Body& body, CollisionVertex a, CollisionVertex b) {
  const auto &na = body.hex.nodes[body.embedding.collision[a]], &nb = body.hex.nodes[body.embedding.collision[b]];
  const auto wa = trilinear_weights(body.embedding.collision_local[a]),
             wb = trilinear_weights(body.embedding.collision_local[b]);
  double shared = 0;
  for (std::size_t i = 0; i < 8; ++i)
    for (std::size_t k = 0; k < 8; ++k)
      if (na[i] == nb[k]) shared += std::min(wa[i], wb[k]);
  return std::clamp(1 - shared, 0.0, 1.0);
}

/// The copy that all vertices of a point hang on, or none.
HexId common_copy(const Body& body, const ContactStep& c, const SurfacePoint& point, CollisionHalfEdge lip) {
  HexId copy;
  for (std::size_t k = 0; k < 3; ++k) {
    const CollisionVertex v = point.vertex[k];
    if (!v.valid() || point.weight[k] == 0) continue;
    HexId own = carrier_of(body, c, v, lip).copy;
    if (!own.valid()) return {};
    if (const auto* corner = carried_corners(c, v); corner != nullptr && own == body.embedding.collision[v]) {
      if (std::fabs(point.lift) != 1) return {};
      own = (*corner)[point.lift > 0 ? 1 : 0].copy;
    }
    if (copy.valid() && copy != own) return {};
    copy = own;
  }
  return copy;
}

/// A tip lies in the middle between where its lips have it.
void place_tips(const Body& body, const RigidShape& frame, ContactStep& c) {
  const auto shift_of = [&](CollisionVertex v, CollisionHalfEdge lip) {
    const EmbeddedPoint carrier = carrier_of(body, c, v, lip);
    if (!carrier.copy.valid() || carrier.copy == body.embedding.collision[v]) return Vec3{};
    return transposed_times(frame.axes, place_of(body.hex, carrier, c.nodes).now - c.positions[v.index()]);
  };
  for (SlitEdge& e : c.slit.edges) {
    const SlitVertex &from = c.slit.vertices[static_cast<std::size_t>(e.from)],
                     &to = c.slit.vertices[static_cast<std::size_t>(e.to)];
    if (from.side == 0) e.from_shift = shift_of(from.vertex, e.edge);
    if (to.side == 0) e.to_shift = shift_of(to.vertex, e.edge);
  }
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(c.slit.vertices.size()); ++i) {
    SlitVertex& tip = c.slit.vertices[static_cast<std::size_t>(i)];
    if (tip.side != 0) continue;
    const auto for_each_shift = [&](auto&& f) {
      for (SlitEdge& e : c.slit.edges) {
        if (e.from == i) f(e.from_shift);
        if (e.to == i) f(e.to_shift);
      }
    };
    Vec3 sum;
    int lips = 0;
    for_each_shift([&](const Vec3& shift) { sum += shift, ++lips; });
    const Vec3 mean = (1.0 / lips) * sum;
    tip.local += mean;
    for_each_shift([&](Vec3& shift) { shift = shift - mean; });
  }
}

}  // namespace

void refresh_surface(const Body& body, ContactStep& c) {
  if (c.surface_stale) rebuild_contact_surface(body.complex.collision, c.surface);
  if (c.surface_stale || c.sides_stale) renew_side_points(body.hex, body.embedding, c.surface, c.sides);
  c.surface_stale = c.sides_stale = false;
}

void add_flanks(const Scene& scene, const Body& body, const std::vector<ToolMotion>& motions, double t, double h,
                DetectMemory& memory, ContactStep& c) {
  if (c.seen.out_of_range) return;
  const auto between_lips = [&](std::size_t i) { return motions[i].is_between_lips(); };
  std::erase_if(memory.rims, [&](const RememberedRim& r) { return !between_lips(static_cast<std::size_t>(r.tool)); });
  std::erase_if(memory.flanks, [&](const ToolContact& f) { return !between_lips(static_cast<std::size_t>(f.tool)); });
  bool any = false;
  for (std::size_t i = 0; i < scene.tools.size(); ++i) {
    if (!between_lips(i)) continue;
    const SurfaceState surface{&c.surface, c.positions, c.offsets, c.predicted};
    const ToolBlade own = tool_blade(scene.tools[i], motions[i].jaws(t + h));
    if (own.width < own.thickness) continue;  // scissors that have hardly begun to close
    const RigidShape& tool = c.tools[i];
    RigidShape frame;
    frame.position = tool.position + tool.axes * own.origin;
    frame.axes = product(tool.axes, own.axes);
    frame.velocity = tool.velocity_at(frame.position);
    frame.spin = tool.spin;
    frame.friction = tool.friction;
    Blade blade{&frame, static_cast<std::int32_t>(i), own.length, own.width, own.thickness};
    blade.stray = kStray * body.complex.mean_root_edge;
    blade.margin = scene.contact.margin * c.surface.largest_radius;
    blade.speed = greatest_speed(tool);
    blade.step = h;
    find_slit(surface, blade, memory, c.slit);
    place_tips(body, frame, c);
    for (SlitVertex& v : c.slit.vertices)
      if (v.facing.valid()) v.freedom = freedom(body, v.vertex, v.facing);
    detect_flanks(surface, blade, c.slit, memory, c.contacts);
    any = true;
  }
  if (any)
    std::sort(c.contacts.begin(), c.contacts.end(), [](const Contact& a, const Contact& b) { return a.key < b.key; });
}

void make_contact_rows(const Body& body, ContactStep& c) {
  c.set.rows.clear();
  c.set.entries.clear();
  c.held_share.clear();
  c.node_slot.assign(body.hex.node_count(), -1);
  for (const Contact& contact : c.contacts) {
    ContactRow row;
    row.key = contact.key;
    row.first = static_cast<std::int32_t>(c.set.entries.size());
    const bool other_body = contact.b.vertex[0].valid();
    double held = 0;
    if (contact.carrier.copy.valid())
      add_entries(body, contact.carrier.copy, corner_weights(contact.carrier.local), 1, row.first, c);
    else held += add_point(body, contact.a, contact.lip, 1, row.first, c);
    if (other_body) held += add_point(body, contact.b, {}, -1, row.first, c);
    c.held_share.push_back(held);
    row.count = static_cast<std::int32_t>(c.set.entries.size()) - row.first;
    if (!other_body)
      row.cell = contact.carrier.copy.valid() ? contact.carrier.copy : common_copy(body, c, contact.a, contact.lip);
    else row.push_speed = kPushRadii * c.surface.largest_radius;
    row.normal = contact.normal;
    row.gap = contact.gap;
    row.friction = contact.friction;
    if (contact.tool >= 0) {
      row.rigid = contact.tool;
      row.arm = contact.point - c.tools[static_cast<std::size_t>(contact.tool)].position;
    } else if (!other_body) {
      row.other_velocity = contact.other_velocity;
    }
    c.set.rows.push_back(row);
  }
}

void hold_in_contact(const Body& body, std::span<const CollisionVertex> held, ContactStep& c) {
  c.held.assign(held.begin(), held.end());
  c.is_held.assign(held.empty() ? 0 : body.complex.collision.vertex_count(), 0);
  for (const CollisionVertex v : held) c.is_held[v.index()] = 1;
}

void hold_sides(std::function<bool(Vec3)> is_held, ContactStep& c) {
  c.sides.is_held = std::move(is_held);
  c.sides.made_from.clear();
  c.sides_stale = true;
}

Vec3 pressed(const Body& body, const MechanicsState& state, const EdgePress& press) {
  const Embedding& e = body.embedding;
  const RigidState& tool = state.tools[static_cast<std::size_t>(press.tool)];
  const Vec3 x =
      point_position(body.hex, {e.collision[press.vertex], e.collision_local[press.vertex]}, state.positions);
  return tool.position + tool.axes * press.local - (x + press.offset);
}

void add_edge_rows(const Body& body, const MechanicsState& state, std::span<const EdgePress> presses, ContactStep& c) {
  for (std::size_t i = 0; i < presses.size(); ++i) {
    const EdgePress& press = presses[i];
    const RigidState& tool = state.tools[static_cast<std::size_t>(press.tool)];
    ContactRow row;
    row.key = std::numeric_limits<std::uint64_t>::max() - (presses.size() - 1 - i);
    row.first = static_cast<std::int32_t>(c.set.entries.size());
    // Where pressed() measures: also in a body of several layers the vertex itself, not the corners of its prism.
    const EmbeddedPoint own = carrier_of(body, c, press.vertex, {});
    if (own.copy.valid()) add_entries(body, own.copy, corner_weights(own.local), 1, row.first, c);
    c.held_share.push_back(own.copy.valid() ? 0 : 1);
    row.count = static_cast<std::int32_t>(c.set.entries.size()) - row.first;
    row.rigid = press.tool;
    row.arm = tool.axes * press.local;
    row.normal = tool.axes * press.direction;
    row.gap = -dot(row.normal, pressed(body, state, press));
    row.stiffness = press.stiffness;
    row.limit = press.limit;
    c.set.rows.push_back(row);
  }
}

Status prepare_contact(const Scene& scene, const Body& body, std::vector<std::string>& notes, ContactStep& c) {
  c.on = wants_contact(scene);
  if (!c.on) return {};
  auto shapes = load_scene_shapes(scene, notes);
  if (!shapes) return shapes.error();
  c.shapes = std::move(*shapes);
  c.surface = make_contact_surface(body.complex.collision);
  choose_side_points(body.hex, c.surface, c.sides);
  if (scene.contact.self) {
    const TightFolds folds = find_tight_folds(c.surface);
    if (folds.vertices > 0)
      notes.push_back(fmt::format(
          "the body is thicker than the gap between its folds: {} vertices of the collision mesh, first ({:.4g}, {:.4g}, {:.4g}), by up to {:.3g} m; such places "
          "do not touch each other; give it less thickness, or widen the gap",
          folds.vertices, folds.first.x, folds.first.y, folds.first.z, folds.overlap));
  }
  const double radius = c.surface.largest_radius;
  const Vec3 cell = largest_cell(body.hex);
  const double thin = radius > 0 ? std::max({cell.x, cell.y, cell.z}) / (kThinCell * radius) : 1;
  c.set.options.stiffness = scene.contact.stiffness * std::clamp(thin, 1.0, kStiffest);
  c.set.options.passes = scene.contact.passes;
  c.set.options.push_speed = scene.contact.push_speed;
  c.set.options.unseen = kUnseen * radius;
  return {};
}

RigidState tool_state(const SceneRigidTool& tool) {
  const RigidPlace place = place_of(tool.position, tool.rotation);
  return {place.position, place.axes, {}, {}};
}

RigidVelocity expected_velocity(const SceneRigidTool& scene_tool, const ToolMotion& motion, const RigidState& now,
                                double t, double h) {
  RigidTool tool = rigid_tool(scene_tool, motion, t, h);
  tool.force = motion.force + motion.resistance;
  tool.torque = motion.torque + motion.resistance_torque;
  ToolWork work;
  prepare_tool(tool, now, h, work);
  return {(1 / work.mass) * Vec3{work.right[0], work.right[1], work.right[2]},
          (1 / work.inertia) * Vec3{work.right[3], work.right[4], work.right[5]}};
}

RigidTool rigid_tool(const SceneRigidTool& tool, const ToolMotion& motion, double t, double h) {
  RigidTool r;
  const double gyration = kToolGyration * kToolGyration;
  r.mass = tool.mass;
  r.inertia = tool.mass * gyration;
  r.stiffness = tool.stiffness;
  r.damping = tool.damping.value_or(2 * std::sqrt(r.stiffness * r.mass));
  r.turning_stiffness = tool.turning_stiffness.value_or(tool.stiffness * gyration);
  r.turning_damping = tool.turning_damping.value_or(2 * std::sqrt(r.turning_stiffness * r.inertia));
  const RigidPlace from = motion.pose(t), to = motion.pose(t + h);
  const RigidVelocity v = velocity_between(from, to, h);
  r.target = to.position;
  r.target_axes = to.axes;
  r.target_velocity = v.linear;
  r.target_spin = v.spin;
  r.max_force = tool.max_force;
  r.max_speed = tool.max_speed;
  return r;
}

/// m: what the tips of jaws move by from t to t + dt while they open or close, in the tool's frame.
static double jaw_travel(const SceneRigidTool& tool, const ToolMotion& motion, double t, double dt) {
  return std::fabs(motion.jaws(t + dt) - motion.jaws(t)) * 0.5 * tool.opening * tool_sizes(tool).tip;
}

int contact_substeps(const Scene& scene, const Body& body, const MechanicsState& state,
                     const std::vector<ToolMotion>& motions, double t, double dt, ContactStep& c) {
  refresh_surface(body, c);
  if (scene.contact.substeps <= 1) return 1;
  place_shapes(scene, state, motions, t, dt, c);
  const SurfaceState surface{&c.surface, {}, {}, {}};  // how thick it is is all that counts
  int parts = 1;
  for (const std::vector<RigidShape>* shapes : {&c.shapes.obstacles, &c.tools})
    parts = std::max(parts, substeps({&surface, 1}, *shapes, dt, scene.contact.substeps));
  for (std::size_t i = 0; i < scene.tools.size(); ++i) {
    const double travel = jaw_travel(scene.tools[i], motions[i], t, dt);
    if (!(travel > 0)) continue;
    const double size = c.surface.largest_radius + thinnest_radius(c.tools[i]);
    if (size > 0)
      parts = std::max(parts, static_cast<int>(std::min(std::ceil(travel / (kJawTravel * size)),
                                                        static_cast<double>(scene.contact.substeps))));
  }
  return parts;
}

void detect_contacts(const Scene& scene, const Body& body, const MechanicsModel& model, const MechanicsState& state,
                     const std::vector<ToolMotion>& motions, double t, double h, Vec3 gravity, DetectMemory& memory,
                     ContactStep& c) {
  refresh_surface(body, c);
  place_shapes(scene, state, motions, t, h, c);
  c.nodes.resize(state.positions.size());
  for (std::size_t i = 0; i < state.positions.size(); ++i) {
    const Vec3 x = state.positions[i], next = predicted_place(model, state, i, h, gravity);
    c.nodes[i] = {{x.x, x.y, x.z, 0}, {next.x, next.y, next.z, 0}};
  }
  SurfaceState surface = surface_state(body, c);
  if (!c.sides.points.empty()) {
    place_side_points(body.hex, c.surface, c.nodes, c.positions, c.offsets, c.sides);
    surface.sides = &c.sides;
    surface.hex = &body.hex;
    surface.nodes = c.nodes;
  }
  c.seen = detect({&surface, 1}, c.shapes.obstacles, c.tools, detect_options(scene, h), memory, c.detect, c.contacts);
  if (!c.seen.out_of_range)
    add_sunk_walls(surface, scene.contact.margin * c.surface.largest_radius, scene.contact.friction, memory,
                   c.contacts);
}

void remember_gaps(std::span<const ContactResult> results, const ContactStep& c, DetectMemory& memory) {
  std::size_t i = 0;
  for (RememberedContact& r : memory.contacts) {
    while (i < c.contacts.size() && c.contacts[i].key < r.key) ++i;
    if (i < c.contacts.size() && c.contacts[i].key == r.key) r.gap = results[i].end_gap;
  }
}

double reckon_overlap(const Body& body, const MechanicsState& ended, double deep, std::span<ContactResult> results,
                      ContactStep& c) {
  double deepest = 0;
  bool known = false;
  SurfaceState surface;
  for (std::size_t i = 0; i < c.contacts.size(); ++i) {
    const Contact& contact = c.contacts[i];
    if (contact.b.vertex[0].valid() && -results[i].end_gap > deep) {
      if (!known) {
        surface = surface_at(body, ended, c);
        prepare_depths(surface, c.depths);
        known = true;
      }
      results[i].end_gap = std::max(results[i].end_gap, -depth_of(surface, contact, c.depths));
    }
    deepest = std::max(deepest, -results[i].end_gap);
  }
  return deepest;
}

bool find_surprise(const Scene& scene, const Body& body, const MechanicsModel& model, const MechanicsState& began,
                   const MechanicsState& ended, const DetectMemory& memory, double h, Vec3 gravity, double deep,
                   std::span<const ContactResult> results, ContactStep& c) {
  c.sunk.clear();
  if (!scene.contact.self) return false;
  const std::size_t n = began.positions.size();
  Vec3 mean, mean_stray;
  for (std::size_t i = 0; i < n; ++i) {
    mean += ended.positions[i] - began.positions[i];
    mean_stray += ended.positions[i] - predicted_place(model, began, i, h, gravity);
  }
  const double share = 1.0 / static_cast<double>(std::max<std::size_t>(n, 1));
  double moved = 0, stray = 0;
  for (std::size_t i = 0; i < n; ++i) {
    moved = std::max(moved, norm(ended.positions[i] - began.positions[i] - share * mean));
    stray =
        std::max(stray, norm(ended.positions[i] - predicted_place(model, began, i, h, gravity) - share * mean_stray));
  }
  // What touches is found where it is as the step begins: corners that pass each other just as foretold may still come to lie in walls. But by no more than they moved.
  if (2 * moved > kSankBy * deep && walls_sank_in(body, began, ended, deep, c)) return true;
  if (!(2 * stray > scene.contact.margin * c.surface.largest_radius)) return false;
  const Strayed strayed = find_strays(body, model, began, ended, h, gravity, c);
  const SurfaceState surface = surface_at(body, ended, c);
  prepare_depths(surface, c.depths);
  c.surprise_memory = memory;
  DetectOptions options = detect_options(scene, h);
  options.strayed = &strayed;
  detect({&surface, 1}, {}, {}, options, c.surprise_memory, c.detect_surprises, c.surprises);
  for (const Contact& contact : c.surprises) {
    if (!(contact.gap < -deep)) continue;
    const auto at = std::lower_bound(c.contacts.begin(), c.contacts.end(), contact.key,
                                     [](const Contact& x, std::uint64_t key) { return x.key < key; });
    const bool known = at != c.contacts.end() && at->key == contact.key;
    if (known && !(contact.gap < results[static_cast<std::size_t>(at - c.contacts.begin())].end_gap - kUnlike * deep))
      continue;
    if (depth_of(surface, contact, c.depths) > deep) return true;
  }
  return false;
}

}  // namespace kerf
