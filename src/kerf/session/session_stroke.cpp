// Strokes: a blade moves through the body, and everything follows; undo and redo of whole strokes.
#include <algorithm>
#include <cmath>
#include <iterator>

#include "kerf/base/stopwatch.h"
#include "kerf/cutting/joined_lips.h"
#include "kerf/session/session_impl.h"

namespace kerf {
namespace {

/// Of the body's size: differences of a vertex' place that are only rounding.
constexpr double kSurfaceRounding = 1e-13;
/// Undo forgets the oldest strokes beyond this.
constexpr std::size_t kUndoBytes = std::size_t{256} << 20;

/// Number of one array in the order of the body's.
std::size_t number_of(Body& body, const void* array) {
  std::size_t found = 0, i = 0;
  body.for_each_array([&](auto& a) {
    if (static_cast<const void*>(&a) == array) found = i;
    ++i;
  });
  return found;
}

/// The mark of one array inside a mark of the whole body.
template <class Array>
typename Array::Mark mark_of(Body& body, const JournalMark& mark, const Array& array) {
  const auto& [size, log] = mark.arrays[number_of(body, &array)];
  return {size, log};
}

/// Adds what was written to one array since a mark, and what was appended.
template <class Id, class T>
void append_changed(Body& body, const JournalMark& since, const Journaled<Id, T>& array, std::vector<Id>& to) {
  const auto mark = mark_of(body, since, array);
  array.for_each_changed(mark, [&](Id id) { to.push_back(id); });
  for (std::size_t i = mark.size; i < array.size(); ++i) to.push_back(Id(i));
}
/// The same for a step that has just been undone or redone.
template <class Id, class T>
void append_changed(Body& body, const JournalStep& step, const Journaled<Id, T>& array, std::vector<Id>& to) {
  const JournalSegment& s = step.arrays[number_of(body, &array)];
  for (const std::uint32_t i : s.indices)
    if (i < array.size()) to.push_back(Id(static_cast<std::size_t>(i)));
  for (std::size_t i = s.base_size; i < array.size(); ++i) to.push_back(Id(i));
}

/// Calls fn(id) for every item of an array that existed at a mark and was written to since, repeats included.
template <class Id, class T, class Fn>
void for_each_written(Body& body, const JournalMark& since, const Journaled<Id, T>& array, Fn&& fn) {
  array.for_each_changed(mark_of(body, since, array), fn);
}
/// The same for a step that has just been undone or redone.
template <class Id, class T, class Fn>
void for_each_written(Body& body, const JournalStep& step, const Journaled<Id, T>& array, Fn&& fn) {
  for (const std::uint32_t i : step.arrays[number_of(body, &array)].indices) fn(Id(static_cast<std::size_t>(i)));
}

/// Everything that taking the body back to `since`, or a step that was undone or redone, changes; `change` holds what it
/// changes of the complex.
template <class Since>
void note_changes(Body& body, const Since& since, const TopologyChange& change, SessionChanges& to) {
  to.collision_triangles.insert(to.collision_triangles.end(), change.triangles.begin(), change.triangles.end());
  to.visual_triangles.insert(to.visual_triangles.end(), change.visual_triangles.begin(), change.visual_triangles.end());
  for (VisualTriangle f = change.first_new_visual_triangle; f.index() < body.complex.visual.face_count(); ++f.value)
    to.visual_triangles.push_back(f);
  append_changed(body, since, body.embedding.visual, to.moved);
  append_changed(body, since, body.hex.state, to.hexahedra);
  append_changed(body, since, body.hex.host, to.hexahedra);
  append_changed(body, since, body.hex.nodes, to.hexahedra);
  append_changed(body, since, body.hex.node_uses, to.nodes);
  append_changed(body, since, body.surface.normal, to.render_vertices);
}

/// The copies among the first `count` whose element depends on what was written since, ascending.
template <class Since>
std::vector<HexId> written_copies(Body& body, const Since& since, std::size_t count) {
  std::vector<HexId> written;
  const auto note = [&](HexId id) {
    if (id.index() < count) written.push_back(id);
  };
  for_each_written(body, since, body.hex.nodes, note);
  for_each_written(body, since, body.hex.state, note);
  for_each_written(body, since, body.hex.material, note);
  for_each_written(body, since, body.hex.weights, note);
  std::sort(written.begin(), written.end());
  written.erase(std::unique(written.begin(), written.end()), written.end());
  return written;
}

}  // namespace

const std::vector<Vec3>& Session::Impl::deformed_collision() {
  if (!collision_positions_valid || collision_positions.size() != state.body.complex.collision.vertex_count()) {
    collision_positions.resize(state.body.complex.collision.vertex_count());
    kerf::collision_positions(state.body.hex, state.body.embedding, shown_nodes(), collision_positions);
    for (const FadingVertex& f : state.fade.collision)
      collision_positions[static_cast<std::size_t>(f.vertex)] += f.offset;
    for (const CollisionVertex v : held_collision())
      collision_positions[v.index()] = state.body.complex.collision.rest[v];
    collision_positions_valid = true;
  }
  return collision_positions;
}

void Session::Impl::place_for_sweep(SceneFrame frame) {
  const bool at_rest = frame == SceneFrame::kRest;
  if (!at_rest || !sweep_at_rest) forget_places();
  sweep_at_rest = at_rest;
  if (!at_rest) {
    sweep_positions = deformed_collision();
    return;
  }
  const std::vector<Vec3>& rest = state.body.complex.collision.rest.raw();
  sweep_known = std::min(sweep_known, rest.size());
  sweep_positions.resize(sweep_known);
  sweep_positions.insert(sweep_positions.end(), rest.begin() + static_cast<std::ptrdiff_t>(sweep_known), rest.end());
  sweep_known = rest.size();
}

template <class Since>
void Session::Impl::sweep_follows(const Since& since, std::size_t vertices, std::size_t faces) {
  const CollisionMesh& mesh = state.body.complex.collision;
  bool moved_at_rest = false;
  for_each_written(state.body, since, mesh.rest, [&](CollisionVertex) { moved_at_rest = true; });
  if (moved_at_rest) return forget_places();
  for_each_written(state.body, since, mesh.origin,
                   [&](CollisionHalfEdge h) { sweep_boxes.mark(CollisionMesh::face(h)); });
  sweep_known = std::min(sweep_known, vertices);
  sweep_boxes.shrink(faces);
}

std::span<const Vec3> Session::Impl::shown_nodes() {
  if (state.fade.nodes.empty()) return state.mechanics.positions;
  add_offsets(state.mechanics.positions, state.fade.nodes.offset, shown);
  return shown;
}

Status Session::Impl::begin_stroke(SceneFrame frame, bool through) {
  if (state.stroke) KERF_TRY(end_stroke());
  swept.reset();
  state.redo.clear();
  begin_pose();  // nothing is remembered of strokes before
  state.stroke = std::make_unique<ActiveStroke>();
  ActiveStroke& stroke = *state.stroke;
  stroke.frame = frame;
  stroke.blade.through = through;
  journal_mark(state.body, stroke.start);
  state.synced = stroke.start;
  stroke.blade.mark = stroke.start;
  stroke.before = state.mechanics;
  stroke.touching = state.touching;
  stroke.steps = state.steps;
  stroke.account = account();
  stroke.fade = state.fade;
  StrokeRecord record;
  record.began = record.ended = state.time;
  record.before = record.after = counts();
  state.strokes.push_back(record);
  return {};
}

const BodyCounts& Session::Impl::counts() {
  if (counted_at != state.topology_version) {
    counted = count_body(state.body, piece_labels.count(state.body.complex.collision, pieces_changed));
    pieces_changed.clear();
    counted_at = state.topology_version;
  }
  return counted;
}

void Session::Impl::begin_pose() {
  begin_surface(state.body, surface);
  balance.clear();
}

void Session::Impl::end_pose() {
  if (!moved_ever()) return;
  if (out_of_balance(state.body.hex, state.model, state.mechanics, balance))
    settle_balance(balance, state.mechanics, state.fade.nodes);
  let_nothing_jump();
}

void Session::Impl::let_nothing_jump() {
  hold_surface(surface_state(), kSurfaceRounding * size, surface, state.fade);
  positions_changed();
}

Status Session::Impl::move_blade(const BladeEdge& edge) {
  if (!state.stroke || state.stroke->shaving) return bad_input("no stroke has begun; begin one before the blade moves");
  KERF_TRY(check_edge(edge));
  const auto start = Clock::now();
  BladeStroke& blade = state.stroke->blade;
  StrokeRecord& record = state.strokes.back();
  Status trouble;
  // The blade meets the body as it is now, or as it was before anything moved.
  place_for_sweep(state.stroke->frame);
  CutTimes following;
  const BladeEdge posed = blade.posed.edge();
  const bool severs = blade.started && !bonds.empty();
  const BladeEdge last_pose = severs ? motion_at(posed, state.stroke->places).moved(posed) : posed;
  begin_pose();
  const bool taken_back = blade.provisional;
  if (taken_back) {
    const CollisionMesh& mesh = state.body.complex.collision;
    const auto lips = find_joined_lips(mesh, mark_of(state.body, blade.mark, mesh.origin),
                                       mark_of(state.body, blade.mark, mesh.rest).size, sweep_positions);
    rollback_to(blade.mark);
    sweep_positions.resize(mesh.vertex_count());
    place_joined_lips(lips, sweep_positions);
    blade.provisional = false;
  }
  std::vector<Vec3>& before = state.stroke->places;
  before.resize(std::min(before.size(), sweep_positions.size()));
  SweepTarget target{state.body.complex, sweep_positions, sweep_boxes,
                     cut_scratch,        cut_options,     before.empty() ? nullptr : &before};
  SweepReport report = lead_blade(blade, edge, target);
  if (report.changed || !taken_back) {
    trouble = follow_complex(following);
    mark_synced();
    blade.mark = state.synced;
  }
  note_uncut(report.uncut);
  const SweepReport ends = make_ends(blade, target);
  state.stroke->uncut_end = ends.uncut;
  report += ends;
  if (report.leaning.distance > state.stroke->leaning.distance) state.stroke->leaning = report.leaning;
  if (state.stroke->frame == SceneFrame::kWorld) before = sweep_positions;
  if (trouble) trouble = follow_complex(following);
  if (!trouble) {
    // What follows the meshes could not; the body goes back to where the stroke began.
    const Status cancelled = cancel_stroke();
    KERF_ASSERT(cancelled.ok());
    (void)cancelled;
    return trouble;
  }
  end_pose();
  if (severs) sever_bonds(last_pose, edge);
  record.triangles += report.steps;
  record.refused += report.refused;
  record.retried += report.retried;
  record.ended = state.time;
  const double total = seconds_since(start);
  record.times.embedding += following.embedding;
  record.times.cut_surface += cut_scratch.wall_seconds;
  record.times.cut_and_binding += total - following.embedding - cut_scratch.wall_seconds;
  record.times.total += total;
  cut_scratch.wall_seconds = 0;
  remembered.clear();
  if (report.steps > 0) note_passed(edge);
  return trouble;
}

Status Session::Impl::follow_complex(CutTimes& times) {
  const auto start = Clock::now();
  Body& body = state.body;
  collect_topology_change(body.complex, state.synced, cut_scratch, topology_change);
  if (topology_change.triangles.empty() && remembered.empty()) return {};
  contact_follows(topology_change.triangles);
  sweep_follows(state.synced, sweep_known, body.complex.collision.face_count());
  pieces_changed.insert(pieces_changed.end(), topology_change.triangles.begin(), topology_change.triangles.end());
  for (const CollisionTriangle f : topology_change.triangles)
    sweep_boxes.mark(f);  // new ones lie where they lie at rest from now on
  lattice_change.clear();
  adapt_lattice(body.complex.collision, body.hex, topology_change.triangles, lattice_scratch, lattice_change);
  moved.clear();
  // Both lists are ascending; what stands in both is looked at once.
  to_embed.clear();
  std::set_union(topology_change.triangles.begin(), topology_change.triangles.end(), lattice_change.triangles.begin(),
                 lattice_change.triangles.end(), std::back_inserter(to_embed));
  embed_triangles(body.complex, body.hex, to_embed, body.embedding, embedding_scratch, moved);
  note_moved(skin, moved);
  if (!bonds.empty()) {
    bonds_follow(to_embed, lattice_change.changed_copies);
    bonds_follow({}, lattice_change.dead_copies);
    bonds_follow({}, lattice_change.new_copies);  // a number may have been another copy's before a rollback
  }
  changed_visual = topology_change.visual_triangles;
  for (VisualTriangle f = topology_change.first_new_visual_triangle; f.index() < body.complex.visual.face_count();
       ++f.value)
    changed_visual.push_back(f);
  update_render_surface(body.complex.visual, changed_visual, body.surface);
  const std::size_t old_nodes = state.mechanics.positions.size(), known_nodes = surface.nodes.size();
  if (moved_ever()) remember_change(surface_state(), state.synced, surface);
  const auto in_balance = [&](auto&& add) {
    if (!moved_ever()) return;
    for (const auto* list : {&lattice_change.changed_copies, &lattice_change.dead_copies, &lattice_change.new_copies})
      for (const HexId id : *list) add(state.model, state.mechanics, id, balance);
  };
  in_balance(leave_balance);
  KERF_TRY(sync_change(body.hex, state.materials, lattice_change, state.model, state.mechanics, state.fade.nodes,
                       surface.nodes));
  recall_cells(body.hex, state.model, remembered, state.mechanics, state.fade.nodes, surface.nodes);
  in_balance(join_balance);
  if (moved_ever()) {
    const auto first = surface.nodes.begin() + static_cast<std::ptrdiff_t>(known_nodes);
    surface.nodes.erase(
        std::remove_if(first, surface.nodes.end(), [&](const NodeMotion& n) { return n.node.index() >= old_nodes; }),
        surface.nodes.end());  // those are new
    changed_hexes = lattice_change.changed_copies;
    changed_hexes.insert(changed_hexes.end(), lattice_change.new_copies.begin(), lattice_change.new_copies.end());
    move_in_balance(body.hex, state.model, state.mechanics, std::span(surface.nodes).subspan(known_nodes),
                    changed_hexes, balance);
    remember_moved(surface_state(), known_nodes, mark_of(body, state.synced, body.hex.cell).size, surface,
                   state.fade.nodes);
  }
  ++state.topology_version;
  springs_stale = true;
  renew_loads();
  positions_changed();
  if (watching) {
    const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
    append(watched.collision_triangles, to_embed);
    append(watched.visual_triangles, changed_visual);
    append(watched.moved, moved);
    for (const auto* list : {&lattice_change.new_copies, &lattice_change.dead_copies, &lattice_change.changed_copies})
      append(watched.hexahedra, *list);
    append(watched.nodes, lattice_change.new_nodes);
    append(watched.nodes, lattice_change.switched_nodes);
    append_changed(body, state.synced, body.surface.normal, watched.render_vertices);
  }
  // The marks move on, so that the next call looks at what is new since this one.
  mark_synced();
  times.embedding += seconds_since(start);
  return {};
}

void Session::Impl::rollback_to(const JournalMark& mark) {
  Body& body = state.body;
  const auto nodes = mark_of(body, mark, body.hex.corner);
  const auto copies = mark_of(body, mark, body.hex.cell);
  const CollisionMesh& mesh = body.complex.collision;
  sweep_follows(mark, mark_of(body, mark, mesh.rest).size, mark_of(body, mark, mesh.root).size);
  append_changed(body, mark, mesh.root, pieces_changed);
  for_each_written(body, mark, mesh.twin,
                   [&](CollisionHalfEdge h) { pieces_changed.push_back(CollisionMesh::face(h)); });
  if (moved_ever()) {
    remember_rollback(surface_state(), mark, surface);
    std::erase_if(surface.nodes, [&](const NodeMotion& n) { return n.node.index() >= nodes.size; });
  }
  note_rollback(skin, body.embedding, mark_of(body, mark, body.embedding.visual));
  if (watching || contact.on) collect_topology_change(body.complex, mark, cut_scratch, topology_change);
  if (watching) {
    note_changes(body, mark, topology_change, watched);
  }
  const std::vector<HexId> touched = written_copies(body, mark, copies.size);
  // The twins of the provisional tip go; when it is walked again its material takes up its motion where it left it.
  remembered_cells.clear();
  for (const HexId id : touched) remembered_cells.push_back(body.hex.cell_id(body.hex.cell[id]));
  for (std::size_t i = copies.size; i < body.hex.hex_count(); ++i)
    remembered_cells.push_back(body.hex.cell_id(body.hex.cell[HexId(i)]));
  remember_cells(body.hex, state.mechanics, state.fade.nodes, remembered_cells, remembered);

  const auto remove = [&](HexId id) {
    leave_balance(state.model, state.mechanics, id, balance);
    state.model.remove_element(id);
  };
  for (std::size_t i = copies.size; i < state.model.element_count(); ++i) remove(HexId(i));
  // Backwards, so that each finds its matrix again when they are set in order.
  for (std::size_t i = touched.size(); i-- > 0;) remove(touched[i]);
  state.model.clear_springs();
  if (!bonds.empty()) bonds_follow(changed_triangles(body.complex, mark), touched);
  journal_rollback(body, mark);
  contact_follows(topology_change.triangles);
  const Status truncated = state.model.truncate(nodes.size, copies.size);
  KERF_ASSERT(truncated.ok());
  (void)truncated;
  state.mechanics.positions.resize(nodes.size);
  state.mechanics.velocities.resize(nodes.size);
  state.fade.nodes.truncate(nodes.size);
  state.mechanics.rotations.resize(copies.size);
  for (const HexId id : touched) {
    const Status synced = sync_hex(body.hex, state.materials, id, state.model);
    KERF_ASSERT(synced.ok());
    (void)synced;
    join_balance(state.model, state.mechanics, id, balance);
  }
  for (const HexId host : hosts_of(body.hex, touched)) {
    if (std::binary_search(touched.begin(), touched.end(), host)) continue;
    const Status synced = sync_hex(body.hex, state.materials, host, state.model);
    KERF_ASSERT(synced.ok());
    (void)synced;
  }
  state.synced = mark;
  ++state.topology_version;
  springs_stale = true;
  renew_loads();
  positions_changed();
}

void Session::Impl::lift_blade() {
  if (!state.stroke || state.stroke->shaving) return;
  note_uncut(state.stroke->uncut_end);
  state.stroke->uncut_end = {};
  kerf::lift_blade(state.stroke->blade);
  mark_synced();
}

Status Session::Impl::end_stroke() {
  if (!state.stroke) return {};
  ActiveStroke& stroke = *state.stroke;
  note_uncut(stroke.uncut_end);
  note_leaning();
  kerf::lift_blade(stroke.blade);
  StrokeRecord& record = state.strokes.back();
  record.finished = true;
  record.ended = state.time;
  record.after = counts();
  const bool idle = record.after == record.before && !stroke.shaved && !stroke.severed;  // every cut makes new vertices
  if (idle) note_idle_stroke();
  const std::vector<std::uint8_t> dust = dust_of_stroke(record.removed);
  const std::string place = std::move(stroke.place);

  UndoStep step;
  step.topology = journal_take(state.body, stroke.start);
  step.mechanics = std::move(stroke.before);
  step.account = std::move(stroke.account);
  step.fade = std::move(stroke.fade);
  step.touching = std::move(stroke.touching);
  step.steps = stroke.steps;
  step.record = state.strokes.size() - 1;
  state.stroke.reset();
  mark_synced();
  if (idle) return {};  // a stroke through the air leaves nothing to undo
  if (!dust.empty()) {
    const auto start = Clock::now();
    auto taken = take_out(dust, step.removal);
    if (!taken) return taken.error();
    record.after = counts();
    record.removed.volume = taken->removed.volume;
    record.removed.share = share_of_uncut(taken->removed.volume);
    record.removed.seconds = seconds_since(start);
    record.times.total += record.removed.seconds;
    swept = std::move(*taken);
    note_dust(record.removed, place);
  }
  add_undo(std::move(step));
  return {};
}

void Session::Impl::add_undo(UndoStep step) {
  state.undo.push(std::move(step));
  while (state.undo.bytes() > kUndoBytes && state.undo.size() > 1) state.undo.forget_oldest();
}

Status Session::Impl::cancel_stroke() {
  if (!state.stroke) return {};
  const std::vector<CollisionVertex> ancestors = grasp_ancestors();
  rollback_to(state.stroke->start);
  remembered.clear();
  set_account(std::move(state.stroke->account));
  // Halves that have drifted apart would be torn together: motion goes back too.
  std::swap(state.stroke->before.tools, state.mechanics.tools);
  state.mechanics = std::move(state.stroke->before);
  state.seen.clear();
  hold_fixed_nodes(state.model, state.mechanics);
  // Ids and places are what they were; only tools and obstacles may have moved on meanwhile.
  if (state.steps == state.stroke->steps) state.touching = std::move(state.stroke->touching);
  else state.touching = {};
  state.fade = std::move(state.stroke->fade);
  state.strokes.pop_back();
  state.stroke.reset();
  keep_grasps_on(ancestors);
  positions_changed();
  springs_stale = true;
  all_bonds_follow();
  return {};
}

std::vector<CollisionVertex> Session::Impl::grasp_ancestors() const {
  std::vector<CollisionVertex> ancestors;
  for (const Grasp& g : state.grasps)
    for (const CollisionVertex v : g.points) ancestors.push_back(state.body.complex.collision.ancestor[v]);
  return ancestors;
}

void Session::Impl::keep_grasps_on(const std::vector<CollisionVertex>& ancestors) {
  const auto& rest = state.body.complex.collision.rest;
  std::size_t i = 0;
  for (Grasp& g : state.grasps) {
    std::size_t kept = 0;
    for (std::size_t k = 0; k < g.points.size(); ++k, ++i) {
      const CollisionVertex v = rest.contains(g.points[k]) ? g.points[k] : ancestors[i];
      const auto so_far = g.points.begin() + static_cast<std::ptrdiff_t>(kept);
      if (!rest.contains(v) || std::find(g.points.begin(), so_far, v) != so_far) continue;
      g.points[kept] = v;
      g.offset[kept] = g.offset[k];
      ++kept;
    }
    g.points.resize(kept);
    g.offset.resize(kept);
  }
}

void Session::Impl::change_sides(const std::vector<Grasp>& were, std::vector<GraspSides>& sides) {
  std::vector<GraspSides> changed;
  for (std::size_t i = 0; i < were.size(); ++i) {
    Grasp& g = state.grasps[i];
    const Grasp& was = were[i];
    // Let go of and taken anew, it is another one.
    const auto known = std::find_if(sides.begin(), sides.end(), [&](const GraspSides& s) {
      return s.id == g.id && s.points == was.points && s.offset == was.offset;
    });
    if (known != sides.end()) g.points = known->other_points, g.offset = known->other_offset;
    if (g.points != was.points) changed.push_back({g.id, g.points, was.points, g.offset, was.offset});
  }
  sides = std::move(changed);
}

Status Session::Impl::travel(UndoList& from, UndoList& to, bool back) {
  if (state.stroke) KERF_TRY(end_stroke());
  if (from.empty()) return bad_input(back ? "there is no stroke to undo" : "there is no stroke to redo");
  UndoStep step = from.pop();
  MechanicsState now = state.mechanics;
  DetectMemory touching = std::move(state.touching);
  state.touching = {};
  // What was taken away went after what was cut.
  if (step.removal && back) KERF_TRY(swap_removal(*step.removal, back));
  if (!step.topology.arrays.empty()) {
    const std::vector<CollisionVertex> ancestors = grasp_ancestors();
    const std::vector<Grasp> grasps = state.grasps;
    state.model.clear_springs();
    if (back) journal_undo(state.body, step.topology);
    else journal_redo(state.body, step.topology);
    keep_grasps_on(ancestors);
    change_sides(grasps, step.grasps);
    const CollisionMesh& mesh = state.body.complex.collision;
    piece_labels.forget();  // they may have grown together
    sweep_follows(step.topology, step.topology.arrays[number_of(state.body, &mesh.rest)].base_size,
                  step.topology.arrays[number_of(state.body, &mesh.root)].base_size);
    BodyAccount other = account();
    set_account(std::move(step.account));
    step.account = std::move(other);
    const HexMesh& hex = state.body.hex;
    KERF_TRY(sync_copies(hex, state.materials, written_copies(state.body, step.topology, hex.hex_count()), state.model,
                         state.mechanics));
  }
  if (step.removal && !back) KERF_TRY(swap_removal(*step.removal, back));
  state.mechanics = std::move(step.mechanics);
  state.seen.clear();
  hold_fixed_nodes(state.model, state.mechanics);  // a support may be newer
  step.mechanics = std::move(now);
  state.mechanics.tools = step.mechanics.tools;  // tools stay where they are
  std::swap(state.fade, step.fade);
  if (step.record < state.strokes.size()) state.strokes[step.record].undone = back;
  mark_synced();
  ++state.topology_version;
  skin_stale = true;
  if ((watching || contact.on) && !step.removal) {  // after a removal everything has another id
    collect_topology_change(state.body.complex, step.topology, cut_scratch, topology_change);
    contact_follows(topology_change.triangles);
  }
  if (watching && !step.removal) note_changes(state.body, step.topology, topology_change, watched);
  // Ids and places are what they were; tools and obstacles may have moved on in later steps.
  if (state.steps == step.steps) state.touching = std::move(step.touching);
  step.touching = std::move(touching);
  step.steps = state.steps;
  to.push(std::move(step));
  positions_changed();
  springs_stale = true;
  all_bonds_follow();
  renew_loads();
  return {};
}

Status Session::Impl::advance_command_stroke(double until) {
  ActiveStroke& stroke = *state.stroke;
  if (stroke.shaving) return advance_command_shave(until);
  const auto& poses = stroke.command.poses;
  const double t = until - stroke.command_began;
  const auto edge = [&](Vec3 base, Vec3 tip) {
    // A line of sight reaches beyond the body, wherever its second point lies.
    if (stroke.command.tool == SceneTool::kLine) {
      Box3 box;
      for (const Vec3 p : deformed_collision()) box.add(p);
      box.add(base);
      tip = base + (2 * box.diagonal() / std::max(norm(tip - base), 1e-300)) * (tip - base);
    }
    return BladeEdge{base, tip};
  };
  // A blade that turns over between two poses has no length on the way; that moment is left out.
  const auto cut_to = [&](Vec3 base, Vec3 tip) {
    return norm(tip - base) > 0 ? move_blade(edge(base, tip)) : Status{};
  };
  // Poses up to now, one after another, then the one in between.
  while (stroke.next_pose < poses.size() && poses[stroke.next_pose].time <= t + 1e-12) {
    KERF_TRY(move_blade(edge(poses[stroke.next_pose].base, poses[stroke.next_pose].tip)));
    ++stroke.next_pose;
  }
  if (stroke.next_pose == poses.size()) return end_stroke();
  if (stroke.next_pose > 0) {
    const SceneBladePose& a = poses[stroke.next_pose - 1];
    const SceneBladePose& b = poses[stroke.next_pose];
    const double s = (t - a.time) / (b.time - a.time);
    if (s > 1e-9) KERF_TRY(cut_to(lerp(a.base, b.base, s), lerp(a.tip, b.tip, s)));
  }
  return {};
}

Status Session::Impl::finish_stroke() {
  swept.reset();
  KERF_TRY(finish_command_stroke());
  return state.stroke ? end_stroke() : Status{};
}

Status Session::Impl::finish_command_stroke() {
  if (!state.stroke || !state.stroke->from_command) return {};
  return advance_command_stroke(HUGE_VAL);
}

}  // namespace kerf
