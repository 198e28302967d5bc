// What holds and pulls the body: fixed regions, grasps, point loads, the glue of slit tips; and the commands for them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <type_traits>

#include "kerf/base/shown_text.h"
#include "kerf/scene/scene_place.h"
#include "kerf/session/session_impl.h"
#include "kerf/session/tolerances.h"
#include "kerf/spatial/triangle_queries.h"

namespace kerf {
namespace {

/// Default stiffness of a grasp, per point held, in units of Young's modulus x cell edge: firm, and well under the
/// cap at which springs begin to hurt the solver.
constexpr double kGraspStiffness = 2;

double least_cell_edge(const HexMesh& hex, HexId copy) {
  const Vec3 cell = hex.frame_of(copy).cell;
  return std::min({cell.x, cell.y, cell.z});
}

/// Where a load acts at rest: within its radius, or else at the nearest place on the surface, which is on one side of a slit. The vertex that is nearest may be on the other.
std::vector<std::pair<CollisionVertex, double>> places_of(const CollisionMesh& mesh, Vec3 point, double radius) {
  const std::vector<Vec3>& rest = mesh.rest.raw();
  const std::vector<CollisionVertex> near = vertices_near(rest, point, radius);
  std::vector<std::pair<CollisionVertex, double>> places;
  const double far = norm(rest[near[0].index()] - point);
  if (far <= radius) {
    for (const CollisionVertex v : near) places.emplace_back(v, 1.0 / static_cast<double>(near.size()));
    return places;
  }
  ClosestPoint best;
  best.distance = far;
  for (const CollisionTriangle t : ids<CollisionTriangle>(mesh.face_count())) {
    std::array<Vec3, 3> corners;
    Box3 box;
    for (int c = 0; c < 3; ++c)
      box.add(corners[static_cast<std::size_t>(c)] = mesh.rest[mesh.origin[CollisionMesh::corner(t, c)]]);
    double square = 0;
    for (int a = 0; a < 3; ++a) {
      const double beyond = std::max({box.min[a] - point[a], point[a] - box.max[a], 0.0});
      square += beyond * beyond;
    }
    if (!(square < best.distance * best.distance)) continue;
    ClosestPoint found;
    closest_point(point, corners, found);
    if (!(found.distance < best.distance)) continue;
    best = found;
    best.triangle = t.value;
  }
  if (!best.valid()) return {{near[0], 1.0}};
  for (int c = 0; c < 3; ++c)
    if (const double share = best.barycentric[static_cast<std::size_t>(c)]; share != 0)
      places.emplace_back(mesh.origin[CollisionMesh::corner(CollisionTriangle(best.triangle), c)], share);
  return places;
}

/// Is it what there is of the body that decides whether this can be done?
bool depends_on_the_body(const SceneCommand& command) {
  return std::holds_alternative<ScenePunch>(command.what) || std::holds_alternative<SceneFixCommand>(command.what) ||
         std::holds_alternative<SceneRemove>(command.what);
}

}  // namespace

std::vector<CollisionVertex> vertices_near(const std::vector<Vec3>& positions, Vec3 point, double radius) {
  std::vector<CollisionVertex> near;
  std::size_t closest = 0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (norm(positions[i] - point) <= radius) near.push_back(CollisionVertex(i));
    if (norm(positions[i] - point) < norm(positions[closest] - point)) closest = i;
  }
  if (near.empty()) near.push_back(CollisionVertex(closest));
  return near;
}

Status Session::Impl::apply(const SceneCommand& command) {
  const std::string place = scene_place(scene, command.line);
  struct Visitor {
    Impl& s;
    const std::string& place;
    Status operator()(const SceneBlade& blade) {
      KERF_TRY(s.finish_command_stroke());
      KERF_TRY(s.begin_stroke(blade.frame, blade.through));
      s.state.stroke->from_command = true;
      s.state.stroke->command = blade;
      s.state.stroke->place = place;
      s.state.stroke->command_began = s.state.time;
      return {};
    }
    Status operator()(const ScenePunch& p) { return s.punch(p, place); }
    Status operator()(const SceneShave& shave) { return s.begin_shave(shave, place); }
    Status operator()(const SceneRemove& r) { return s.remove(r, place); }
    Status operator()(const SceneGrasp& g) { return s.grasp(g, place); }
    Status operator()(const SceneMove& m) { return s.note_lost_grasp(m.id, place, "move") ? Status{} : s.move(m); }
    Status operator()(const SceneRelease& r) {
      return s.note_lost_grasp(r.id, place, "release") ? Status{} : s.release(r);
    }
    Status operator()(const SceneFixCommand& f) { return s.fix(f.region, "the fix command"); }
    Status operator()(const SceneUnfix& u) { return s.unfix(u.region, place), Status{}; }
    Status operator()(const SceneToolMotion& m) { return s.move_tool(m); }
    Status operator()(const SceneJaws& j) { return s.move_jaws(j); }
    Status operator()(const SceneUndo& u) { return several(u.count, true); }
    Status operator()(const SceneRedo& r) { return several(r.count, false); }
    /// What is beyond the last stroke is noted: one that met nothing left nothing to take back.
    Status several(int count, bool back) {
      KERF_TRY(s.finish_command_stroke());
      for (int i = 0; i < count; ++i) {
        if ((back ? s.state.undo : s.state.redo).empty()) {
          s.add_note(fmt::format("{}there was no stroke left to {}", place, back ? "undo" : "redo"));
          return {};
        }
        KERF_TRY(back ? s.undo() : s.redo());
      }
      return {};
    }
  };
  Status done = std::visit(Visitor{*this, place}, command.what);
  if (!done && !place.empty()) return Error{done.error().kind, place + done.error().message};
  return done;
}

Status Session::Impl::apply_due(const SceneCommand& command) {
  Status done = apply(command);
  if (done || !depends_on_the_body(command)) return done;
  add_note(fmt::format("{}; this command of {:.6g} s was skipped", done.error().message, command.at));
  return {};
}

void Session::Impl::lose_empty_grasps() {
  for (const Grasp& g : state.grasps)
    if (g.points.empty()) state.lost_grasps.push_back(g.id);
  std::erase_if(state.grasps, [](const Grasp& g) { return g.points.empty(); });
}

bool Session::Impl::note_lost_grasp(const std::string& id, const std::string& place, const char* what) {
  if (std::find(state.lost_grasps.begin(), state.lost_grasps.end(), id) == state.lost_grasps.end()) return false;
  add_note(fmt::format("{}there was nothing left to {}: what grasp '{}' held had been taken away", place, what,
                       kerf::shown(id)));
  return true;
}

Status Session::Impl::grasp(const SceneGrasp& what, const std::string& place) {
  if (!is_finite(what.point) || !(what.radius >= 0) ||
      (what.stiffness && !(*what.stiffness > 0 && std::isfinite(*what.stiffness))))
    return bad_input(fmt::format("grasp '{}': point, radius (>= 0) and stiffness (> 0) must be finite numbers",
                                 kerf::shown(what.id)));
  const std::vector<Vec3>& now = deformed_collision();
  const std::vector<Vec3>& positions = what.frame == SceneFrame::kRest ? state.body.complex.collision.rest.raw() : now;
  std::vector<CollisionVertex> points = vertices_near(positions, what.point, what.radius);
  note_far_point(fmt::format("{}grasp '{}' takes hold", place, kerf::shown(what.id)), positions, points, what.point,
                 what.radius, what.frame);
  return hold(what.id, std::move(points), what.stiffness);
}

Status Session::Impl::hold(const std::string& id, std::vector<CollisionVertex> points,
                           std::optional<double> stiffness) {
  for (const Grasp& g : state.grasps)
    if (g.id == id)
      return bad_input(
          fmt::format("there is a grasp '{}' already; release it first or use another id", kerf::shown(id)));
  Grasp g;
  g.id = id;
  g.points = std::move(points);
  // Where the nodes put the points: what pulls them is measured there.
  const Embedding& e = state.body.embedding;
  const auto now = [&](CollisionVertex v) {
    if (stays(v)) return state.body.complex.collision.rest[v];
    return point_position(state.body.hex, {e.collision[v], e.collision_local[v]}, state.mechanics.positions);
  };
  for (const CollisionVertex v : g.points) g.centre += (1.0 / static_cast<double>(g.points.size())) * now(v);
  for (const CollisionVertex v : g.points) g.offset.push_back(now(v) - g.centre);
  g.from = g.to = g.centre;
  g.move_began = state.time;
  const HexId held = state.body.embedding.collision[g.points[0]];
  const double per_point = kGraspStiffness * young_at(held) * least_cell_edge(state.body.hex, held);
  g.stiffness = stiffness ? *stiffness / static_cast<double>(g.points.size()) : per_point;
  std::erase(state.lost_grasps, id);
  state.grasps.push_back(std::move(g));
  return renew_springs();
}

double Session::Impl::young_at(HexId copy) const {
  return state.model.materials()[state.materials.of(state.body.hex.material[copy].body)].young;
}

Status Session::Impl::move(const SceneMove& what) {
  if ((what.to && !is_finite(*what.to)) || (what.by && !is_finite(*what.by)) ||
      !(what.over >= 0 && std::isfinite(what.over)))
    return bad_input(fmt::format("move of grasp '{}': places and times must be finite numbers", kerf::shown(what.id)));
  for (Grasp& g : state.grasps)
    if (g.id == what.id) {
      g.from = g.centre;
      g.to = what.to ? *what.to : g.centre + what.by.value_or(Vec3{});
      g.move_began = state.time;
      g.move_over = what.over;
      return {};
    }
  return bad_input(fmt::format("there is no grasp '{}' to move", kerf::shown(what.id)));
}

Status Session::Impl::release(const SceneRelease& what) {
  const auto before = state.grasps.size();
  std::erase_if(state.grasps, [&](const Grasp& g) { return g.id == what.id; });
  if (state.grasps.size() == before)
    return bad_input(fmt::format("there is no grasp '{}' to release", kerf::shown(what.id)));
  return renew_springs();
}

void Session::Impl::aim_holds(double until) {
  for (Grasp& g : state.grasps) {
    if (g.tool >= 0) {
      const RigidState& tool = state.mechanics.tools[static_cast<std::size_t>(g.tool)];
      g.centre = g.from = g.to = tool.position + tool.axes * g.local;
      g.turned = product(tool.axes, transposed(g.axes_then));
    } else {
      g.centre = lerp(g.from, g.to, g.move_over > 0 ? std::clamp((until - g.move_began) / g.move_over, 0.0, 1.0) : 1.0);
    }
    for (std::size_t i = 0; i < g.springs.size(); ++i)
      if (state.model.has_spring(g.springs[i]))
        state.model.set_spring_target(g.springs[i], g.centre + g.turned * g.offset[i]);
  }
}

void Session::Impl::bonds_follow(std::span<const CollisionTriangle> triangles, std::span<const HexId> copies) {
  if (bonds.empty()) return;
  bonds_stale = true;
  const CollisionMesh& mesh = state.body.complex.collision;
  for (const CollisionTriangle t : triangles) {
    if (!mesh.root.contains(t)) continue;
    const std::size_t r = mesh.root[t].index();
    if (r >= stale_roots.size()) stale_roots.resize(r + 1, 0);
    stale_roots[r] = 1;
  }
  for (const HexId h : copies) {
    if (h.index() >= stale_copies.size()) stale_copies.resize(h.index() + 1, 0);
    stale_copies[h.index()] = 1;
  }
}

void Session::Impl::renew_bonds() {
  if (!bonds_stale) return;
  list_root_triangles(state.body.complex.collision, root_triangles);
  const auto flagged = [](const std::vector<std::uint8_t>& flags, auto id) {
    return !id.valid() || (id.index() < flags.size() && flags[id.index()] != 0);
  };
  for (std::size_t p = 0; p < bonds.places.size(); ++p) {
    const BondPlace& place = bonds.places[p];
    const BondPoint& was = state.model.bond_points()[p];
    bool stale = all_bonds_stale;
    for (std::size_t side = 0; side < 2; ++side)
      stale = stale || flagged(stale_roots, place.root[side]) || flagged(stale_copies, was.element[side]) ||
              !state.model.has_element(was.element[side]);
    if (!stale) continue;
    const BondPoint now = bond_point(state.body, place, root_triangles);
    if (now.element != was.element || now.local != was.local) state.model.set_bond_point(p, now);
  }
  std::fill(stale_roots.begin(), stale_roots.end(), std::uint8_t{0});
  std::fill(stale_copies.begin(), stale_copies.end(), std::uint8_t{0});
  bonds_stale = all_bonds_stale = false;
}

Status Session::Impl::validate_bonds() const {
  if (bonds.empty() || bonds_stale) return {};
  RootTriangles roots;
  list_root_triangles(state.body.complex.collision, roots);
  for (std::size_t p = 0; p < bonds.places.size(); ++p) {
    const BondPoint now = bond_point(state.body, bonds.places[p], roots);
    const BondPoint& held = state.model.bond_points()[p];
    if (now.element == held.element && now.local == held.local) continue;
    return failed(fmt::format("bond point {} holds on to hexahedra {} and {}, its place lies in {} and {}", p,
                              held.element[0].value, held.element[1].value, now.element[0].value,
                              now.element[1].value));
  }
  return {};
}

void Session::Impl::sever_bonds(const BladeEdge& from, const BladeEdge& to) {
  if (bonds.empty()) return;
  renew_bonds();
  Box3 reached;
  for (const Vec3 p : {from.base, from.tip, to.base, to.tip}) reached.add(p);
  const bool at_rest = state.stroke && state.stroke->frame == SceneFrame::kRest;
  for (std::size_t p = 0; p < bonds.places.size(); ++p) {
    double& damage = state.mechanics.bond_damage[p];
    if (!(damage < 1)) continue;
    const BondPlace& place = bonds.places[p];
    Vec3 middle = place.rest, normal = place.normal, gap;
    if (!at_rest) {
      const BondPoint& point = state.model.bond_points()[p];
      std::array<Vec3, 2> ends;
      Vec3 turned;
      bool there = true;
      for (std::size_t side = 0; side < 2; ++side) {
        there = there && point.element[side].valid();
        if (!there) break;
        ends[side] =
            point_position(state.body.hex, {point.element[side], point.local[side]}, state.mechanics.positions);
        turned += state.mechanics.rotations[point.element[side].index()] *
                  transposed_times(state.body.hex.frame_of(point.element[side]).axes, place.normal);
      }
      if (!there) continue;
      middle = 0.5 * (ends[0] + ends[1]);
      gap = ends[1] - ends[0];
      normal = norm(turned) > 0 ? normalized(turned) : place.normal;
    }
    const double reach = place.reach + 0.5 * norm(gap);
    if (norm(middle - reached.center()) > 0.5 * reached.diagonal() + reach) continue;
    if (!sweeps(from, to, middle - reach * normal, middle + reach * normal)) continue;
    damage = 1;
    if (state.stroke) state.stroke->severed = true;
  }
}

bool Session::Impl::is_bonded(const Contact& c) const {
  if (bonds.empty() || c.tool >= 0 || c.obstacle >= 0 || !c.b.vertex[0].valid()) return false;
  const CollisionMesh& mesh = state.body.complex.collision;
  const auto rest_of = [&](const SurfacePoint& s) {
    Vec3 at;
    for (std::size_t k = 0; k < 3; ++k)
      if (s.vertex[k].valid()) at += s.weight[k] * (mesh.rest[s.vertex[k]] + s.lift * mesh.offset[s.vertex[k]]);
    return at;
  };
  const auto body_of = [&](const SurfacePoint& s) {
    return state.body.hex.material[state.body.embedding.collision[s.vertex[0]]].body;
  };
  const std::int32_t one = body_of(c.a), other = body_of(c.b);
  if (one == other) return false;
  const Vec3 a = rest_of(c.a), b = rest_of(c.b);
  bool bonded = false;
  bonds.for_each_near(a, [&](std::int32_t p) {
    const BondPlace& place = bonds.places[static_cast<std::size_t>(p)];
    const std::array<std::int32_t, 2>& joined = bonds.bodies[static_cast<std::size_t>(place.law)];
    const double spacing = spacing_of(place);
    bonded = bonded || (state.mechanics.bond_damage[static_cast<std::size_t>(p)] < kLooseBond &&
                        std::minmax(joined[0], joined[1]) == std::minmax(one, other) &&
                        norm(place.rest - a) < kBesideBond * spacing && norm(place.rest - b) < kAcrossBond * spacing);
  });
  return bonded;
}

Status Session::Impl::renew_springs() {
  const Body& body = state.body;
  springs_stale = false;
  renew_bonds();
  state.model.clear_springs();
  for (Grasp& g : state.grasps) {
    g.springs.clear();
    for (std::size_t i = 0; i < g.points.size(); ++i) {
      // One that went with an undone cut, or that a support holds.
      if (!body.complex.collision.rest.contains(g.points[i]) || stays(g.points[i])) {
        g.springs.push_back({});
        continue;
      }
      const HexId copy = body.embedding.collision[g.points[i]];
      const auto w = weights(body.hex, copy, body.complex.collision.rest[g.points[i]]);
      auto receipt = state.model.add_attachment(copy, w, g.centre + g.turned * g.offset[i], g.stiffness);
      if (!receipt) return receipt.error();
      g.springs.push_back(receipt->id);
    }
  }
  KERF_TRY(hold_borders());
  tip_glue(body.hex, glue);
  for (const TipGlue& g : glue) {
    auto receipt = state.model.add_node_pair(g.a, g.b, g.stiffness_over_e * young_at(g.copy));
    if (!receipt) return receipt.error();
  }
  return {};
}

std::vector<NodeId> Session::Impl::nodes_in(const SceneRegion& region) const {
  const HexMesh& hex = state.body.hex;
  std::vector<NodeId> nodes;
  bool any = false;
  for (const NodeId n : ids<NodeId>(hex.node_count()))
    if (region.contains(hex.rest(n))) {
      nodes.push_back(n);
      any |= hex.active(n);
    }
  if (any) return nodes;  // with those that a later cut may use again
  nodes.clear();
  // A region smaller than a cell: the cells that hold its material.
  const CollisionMesh& mesh = state.body.complex.collision;
  for (const CollisionVertex v : ids<CollisionVertex>(mesh.vertex_count()))
    if (region.contains(mesh.rest[v]))
      for (const NodeId n : hex.nodes[state.body.embedding.collision[v]]) nodes.push_back(n);
  return nodes;
}

bool Session::Impl::crosses_material(const HeldRegions& held, std::vector<CellId>& cells) const {
  const HexMesh& hex = state.body.hex;
  bool any = false;
  for (const HexId id : ids<HexId>(hex.hex_count())) {
    if (hex.state[id] == HexState::kDead || held_part(hex, held, id) != HeldPart::kSome) continue;
    cells.push_back(hex.cell_id(hex.cell[id]));
    any = any || !held_material(hex, held, id).held.empty();
  }
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  return any;
}

std::vector<std::uint8_t> Session::Impl::nodes_of_held_material() const {
  const HexMesh& hex = state.body.hex;
  const HeldRegions& held = state.materials.held;
  std::vector<std::uint8_t> moves(hex.node_count(), 0), stays(hex.node_count(), 0);
  for (const HexId h : ids<HexId>(hex.hex_count())) {
    if (hex.state[h] == HexState::kDead) continue;
    const HeldPart part = held_part(hex, held, h);
    if (part == HeldPart::kNone || (part == HeldPart::kSome && !held.cross)) continue;
    const bool free = part == HeldPart::kSome && !held_material(hex, held, h).free.empty();
    for (const NodeId n : hex.nodes[h]) (free ? moves : stays)[n.index()] = 1;
  }
  for (const NodeId n : ids<NodeId>(hex.node_count()))
    stays[n.index()] = moves[n.index()] == 0 && held.says(hex.rest(n)).value_or(stays[n.index()] != 0) ? 1 : 0;
  return stays;
}

Status Session::Impl::renew_held(std::size_t first) {
  const HexMesh& hex = state.body.hex;
  HeldRegions& held = state.materials.held;
  if (held.changes.empty()) return {};
  const bool crossed = held.cross;
  const std::vector<HeldRegions::Change> newer(held.changes.begin() + static_cast<std::ptrdiff_t>(first),
                                               held.changes.end());
  held.changes.resize(first);
  trace_held();
  const std::vector<std::uint8_t> before = nodes_of_held_material();
  held.changes.insert(held.changes.end(), newer.begin(), newer.end());
  trace_held();
  const std::vector<std::uint8_t> after = nodes_of_held_material();
  for (const NodeId n : ids<NodeId>(hex.node_count())) {
    const bool holds = after[n.index()] != 0;
    const auto asks = std::find_if(newer.rbegin(), newer.rend(), [&](const HeldRegions::Change& change) {
      return change.region.contains(hex.rest(n));
    });
    if (holds == (before[n.index()] != 0) && (asks == newer.rend() || asks->held != holds)) continue;
    if (holds) state.model.fix_node(n);
    else state.model.release_node(n);
  }
  if (!crossed && !held.cross) return {};
  for (const HexId id : ids<HexId>(hex.hex_count())) KERF_TRY(sync_hex(hex, state.materials, id, state.model));
  springs_stale = true;
  return {};
}

void Session::Impl::trace_held() {
  HeldRegions& held = state.materials.held;
  forget_held();
  held.cells.clear();
  held.trace(state.body.hex);
  held.cross = crosses_material(held, held.cells);
  if (!held.cross) held.cells.clear();
}

Status Session::Impl::hold_borders() {
  const HexMesh& hex = state.body.hex;
  hold_springs.clear();
  for (const CellId c : state.materials.held.cells)
    for (HexId id = hex.first_copy[c]; id.valid(); id = hex.next_in_cell[id]) {
      const HexId host = hex.host[id];
      if (!host.valid() || !hex.alive(host)) continue;
      const Vec3 cell = hex.frame_of(id).cell;
      const double full = kHoldStiffness *
                          state.model.materials()[static_cast<std::size_t>(state.model.element(host).material)].young *
                          std::cbrt(cell.x * cell.y * cell.z);
      const auto& nodes = hex.nodes[host];
      std::vector<std::pair<std::array<double, 8>, double>> points;
      for (const MaterialPoint& p : held_material(hex, state.materials.held, id).held)
        points.emplace_back(weights(hex, host, rest_place(hex, hex.cell[id], p.xi)), p.volume);
      for (const BorderRow& row : border_rows(points)) {
        RowSpring spring;
        spring.nodes = nodes;
        spring.weights = row.weights;
        for (std::size_t k = 0; k < 8; ++k) spring.target += row.weights[k] * hex.rest(nodes[k]);
        spring.stiffness = full;
        auto added = state.model.add_spring(spring);
        if (!added) return added.error();
        hold_springs.push_back(*added);
      }
    }
  return {};
}

Status Session::Impl::fix(const SceneRegion& region, const std::string& name) {
  forget_held();
  const HexMesh& hex = state.body.hex;
  const std::vector<NodeId> nodes = nodes_in(region);
  const bool any =
      std::any_of(nodes.begin(), nodes.end(), [&](NodeId n) { return hex.active(n) && region.contains(hex.rest(n)); });
  HeldRegions& held = state.materials.held;
  std::vector<CellId> cells;
  HeldRegions only;
  only.changes = {{region, true}};
  // What has moved is held where it is now, by its nodes.
  const bool crosses = !moved_ever() && crosses_material(only, cells);
  if (nodes.empty() && !crosses)
    return bad_input(
        fmt::format("{} holds nothing: no node of the hexahedra and no collision vertex lies in it (rest coordinates, "
                    "metres); make it larger or move it onto the body",
                    name));
  if (!moved_ever() && (any || crosses)) {
    held.changes.push_back({region, true});
    KERF_TRY(renew_held(held.changes.size() - 1));
  } else {
    for (const NodeId n : nodes) state.model.fix_node(n);
  }
  hold_fixed_nodes(state.model, state.mechanics);
  if (!crosses) note_hinge(region, name);
  return {};
}

std::span<const CollisionVertex> Session::Impl::held_collision() {
  if (collision_held_at != state.topology_version)
    find_held_vertices(state.body, state.materials.held, state.model, collision_held);
  collision_held_at = state.topology_version;
  return collision_held;
}

bool Session::Impl::stays(CollisionVertex v) {
  const std::span<const CollisionVertex> held = held_collision();
  return std::binary_search(held.begin(), held.end(), v);
}

Vec3 Session::Impl::pull_of(const Grasp& g, std::size_t i) {
  if (state.model.has_spring(g.springs[i])) return spring_force(state.model, state.mechanics, g.springs[i]);
  if (!stays(g.points[i])) return {};
  return g.stiffness * (g.centre + g.turned * g.offset[i] - state.body.complex.collision.rest[g.points[i]]);
}

std::span<const VisualVertex> Session::Impl::held_visual() {
  if (visual_held_at != state.topology_version)
    find_held_vertices(state.body, state.materials.held, state.model, visual_held);
  visual_held_at = state.topology_version;
  return visual_held;
}

std::span<const FadingVertex> Session::Impl::beside_visual() {
  const std::span<const VisualVertex> held = held_visual();
  if (held.empty()) return state.fade.visual;
  std::vector<Vec3> velocities;
  add_offsets(state.mechanics.velocities, state.fade.nodes.velocity, velocities);
  add_held(state.body, {shown_nodes(), velocities}, held, state.fade.visual, visual_beside);
  return visual_beside;
}

void Session::Impl::note_hinge(const SceneRegion& region, const std::string& name) {
  const HexMesh& hex = state.body.hex;
  std::vector<Vec3> places;
  for (const NodeId n : ids<NodeId>(hex.node_count()))
    if (hex.active(n) && state.model.is_fixed(n) && region.contains(hex.rest(n))) places.push_back(hex.rest(n));
  if (places.empty()) return;
  std::size_t far = 0;
  for (std::size_t i = 0; i < places.size(); ++i)
    if (norm(places[i] - places[0]) > norm(places[far] - places[0])) far = i;
  const Vec3 line = places[far] - places[0];
  const double length = norm(line);
  double off = 0;
  for (const Vec3 x : places) off = std::max(off, norm(cross(line, x - places[0])));
  if (off > kHingeWidth * size * length) return;
  add_note(fmt::format(
      "{} holds the nodes of the hexahedra along {} only, so the body can turn about {}; make it larger where that is not meant",
      name, length > kHingeWidth * size ? "a line" : "a point",
      length > kHingeWidth * size ? "that line" : "that point"));
}

void Session::Impl::unfix(const SceneRegion& region, const std::string& place) {
  bool held = false, material = false;
  const HexMesh& hex = state.body.hex;
  HeldRegions& regions = state.materials.held;
  for (const CellId c : regions.cells)
    for (HexId id = hex.first_copy[c]; id.valid(); id = hex.next_in_cell[id])
      for (const MaterialPoint& p : held_material(hex, regions, id).held)
        material = material || region.contains(rest_place(hex, hex.cell[id], p.xi));
  forget_held();
  for (const NodeId n : nodes_in(region)) {
    held = held || state.model.is_fixed(n);
    material = material || (state.model.is_fixed(n) && region.contains(hex.rest(n)));
    state.model.release_node(n);
  }
  held = held || material;
  if (material && !regions.changes.empty()) {
    const std::vector<VisualVertex> visual_then(held_visual().begin(), held_visual().end());
    const std::vector<CollisionVertex> collision_then(held_collision().begin(), held_collision().end());
    regions.changes.push_back({region, false});
    if (const Status done = renew_held(regions.changes.size() - 1); !done) add_note(done.error().message);
    fade_let_go(visual_then, collision_then);
  }
  if (!held)
    add_note(fmt::format(
        "{}unfix lets go of nothing: no node that is held lies in its region (rest coordinates, metres); make it larger or move it onto what is held",
        place));
}

void Session::Impl::fade_let_go(std::span<const VisualVertex> visual, std::span<const CollisionVertex> collision) {
  std::vector<Vec3> velocities;
  add_offsets(state.mechanics.velocities, state.fade.nodes.velocity, velocities);
  const ShownNodes nodes{shown_nodes(), velocities};
  const auto fade = [&](auto then, auto now, std::vector<FadingVertex>& fades) {
    std::vector<std::remove_const_t<typename decltype(then)::element_type>> let_go;
    std::set_difference(then.begin(), then.end(), now.begin(), now.end(), std::back_inserter(let_go));
    std::vector<FadingVertex> with;
    add_held(state.body, nodes, std::span<const typename decltype(let_go)::value_type>(let_go), fades, with);
    fades = std::move(with);
  };
  fade(visual, held_visual(), state.fade.visual);
  fade(collision, held_collision(), state.fade.collision);
  positions_changed();
}

void Session::Impl::renew_loads() {
  if (scene.loads.empty()) return;
  state.model.clear_loads();
  held_load = {};
  const Body& body = state.body;
  const auto add = [&](CollisionVertex v, Vec3 force) {
    if (stays(v)) {
      held_load += force;
      return;
    }
    const HexId copy = body.embedding.collision[v];
    const auto w = weights(body.hex, copy, body.complex.collision.rest[v]);
    for (std::size_t c = 0; c < 8; ++c) state.model.add_load(body.hex.nodes[copy][c], w[c] * force);
  };
  if (load_places_at != state.topology_version) {
    load_places.clear();
    for (const SceneLoad& load : scene.loads)
      load_places.push_back(places_of(body.complex.collision, load.point, load.radius));
    load_places_at = state.topology_version;
  }
  for (std::size_t i = 0; i < scene.loads.size(); ++i) {
    const SceneLoad& load = scene.loads[i];
    if (state.time < load.from || (load.until && state.time >= *load.until)) continue;
    for (const auto& [v, share] : load_places[i]) add(v, share * load.force);
  }
}

}  // namespace kerf
