#include "kerf/session/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "kerf/base/stopwatch.h"
#include "kerf/cutting/pieces.h"
#include "kerf/embedding/embedding_validate.h"
#include "kerf/lattice/lattice_validate.h"
#include "kerf/scene/scene_limits.h"
#include "kerf/scene/scene_place.h"
#include "kerf/session/scene_bodies.h"
#include "kerf/session/session_impl.h"
#include "kerf/session/tolerances.h"

namespace kerf {
namespace {

constexpr std::size_t kParallelNodes = 2000;
/// Items per journaled array that a session has room for before it must allocate.
constexpr std::size_t kLeastReserve = 1024, kMostReserve = 32768;

/// Strokes share one provisional tip and one journal, so they follow each other.
Status check_commands(const Scene& scene) {
  double end = -1;
  int line = 0;
  for (const SceneCommand& c : scene.commands) {
    const auto* blade = std::get_if<SceneBlade>(&c.what);
    if (!blade) continue;
    if (blade->poses.empty())
      return bad_input(scene_place(scene, c.line) + "this blade has no poses; give it two or more to sweep between");
    if (c.at * (1 + kSameTime) < end)
      return bad_input(
          fmt::format("{}this blade starts at {} s, before the one {}has ended ({} s); one blade cuts at a time",
                      scene_place(scene, c.line), c.at, line > 0 ? fmt::format("of line {} ", line) : "", end));
    end = c.at + blade->poses.back().time;
    line = c.line;
  }
  return {};
}

CutOptions cut_options(const Scene& scene) {
  CutOptions options;
  options.layers = scene.cut.layers;
  options.minimum_feature = scene.cut.minimum_feature;
  options.path_tolerance = scene.cut.path_tolerance;
  options.seed = static_cast<std::uint64_t>(scene.simulation.seed);
  options.roughness = scene.cut.roughness;
  return options;
}

}  // namespace

std::size_t UndoStep::bytes() const {
  std::size_t held = 0;
  for (const GraspSides& g : grasps)
    held += (g.points.size() + g.other_points.size()) * (sizeof(CollisionVertex) + sizeof(Vec3));
  return held + touching.bytes() + topology.bytes() +
         (mechanics.positions.size() + mechanics.velocities.size()) * sizeof(Vec3) +
         mechanics.rotations.size() * sizeof(Mat3) + mechanics.bond_damage.size() * sizeof(double) + fade.bytes() +
         (removal ? removal->bytes() : 0);
}

void UndoList::push(UndoStep step) {
  const std::size_t bytes = step.bytes();
  bytes_ += bytes;
  steps_.emplace_back(std::move(step), bytes);
}
UndoStep UndoList::pop() {
  UndoStep step = std::move(steps_.back().first);
  bytes_ -= steps_.back().second;
  steps_.pop_back();
  return step;
}
void UndoList::forget_oldest() {
  bytes_ -= steps_.front().second;
  steps_.pop_front();
}
void UndoList::clear() {
  steps_.clear();
  bytes_ = 0;
}

SessionState::SessionState(const SessionState& o)
    : body(o.body), model(o.model), mechanics(o.mechanics), fade(o.fade), materials(o.materials), measures(o.measures),
      gravity(o.gravity), largest_tool_force(o.largest_tool_force), time(o.time), steps(o.steps),
      next_command(o.next_command), grasps(o.grasps), lost_grasps(o.lost_grasps), tools(o.tools), seen(o.seen),
      touching(o.touching), stroke(o.stroke ? std::make_unique<ActiveStroke>(*o.stroke) : nullptr), synced(o.synced),
      undo(o.undo), redo(o.redo), strokes(o.strokes), topology_version(o.topology_version) {}

SessionState& SessionState::operator=(const SessionState& other) {
  SessionState copy(other);
  *this = std::move(copy);
  return *this;
}

Session::Session(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Session::Session(Session&&) noexcept = default;
Session& Session::operator=(Session&&) noexcept = default;
Session::~Session() = default;

Result<Session> Session::create(const Scene& scene, const Progress& progress) {
  auto impl = std::make_unique<Impl>();
  impl->scene = scene;
  KERF_TRY(check_commands(scene));
  std::vector<BodyMemory> cells;
  try {
    auto loaded = load_scene_bodies(scene, progress);
    if (!loaded) return loaded.error();
    cells = loaded->memory;
    KERF_TRY(impl->prepare(std::move(*loaded), progress));
  } catch (const std::bad_alloc&) {
    impl.reset();
    return failed(lack_of_memory(scene, cells));
  }
  return Session(std::move(impl));
}

Status Session::Impl::prepare(SceneBodies&& loaded, const Progress& progress) {
  said.texts = std::move(loaded.notes);
  auto body = build_body(std::move(loaded.complex), std::move(loaded.bodies), progress);
  if (!body) return body.error();
  state.body = std::move(*body);
  cut_options = kerf::cut_options(scene);
  KERF_TRY(check_cut_options(cut_options));
  if (scene.cut.snap)
    said.texts.push_back(
        "[cut] snap decides nothing: a path goes through a vertex within the minimum_feature, along the edge. Take the line out.");
  state.measures = measure_complex(state.body.complex);
  if (!(scene.cut.dust >= 0 && scene.cut.dust <= kMostDust))
    return bad_input(fmt::format(
        "dust is {} in [cut]; it is a share of the uncut body's volume and goes from 0, which leaves every piece, to {}",
        scene.cut.dust, kMostDust));
  for (const LatticeBody& b : state.body.hex.bodies) uncut.volume.push_back(b.volume);
  uncut.roots = state.body.complex.collision.face_count();
  if (scene.lesion) {
    tissue_at_start = tissue_volume(state.body.complex, *scene.lesion);
    pieces_at_start = collision_pieces(state.body.complex).count;
    if (!(tissue_at_start.lesion > 0))
      return at_line(scene, scene.lesion->line,
                     bad_input("[lesion] marks nothing of the body (rest coordinates, metres); move it onto the body"));
  }
  size = 0;
  for (const LatticeBody& b : state.body.hex.bodies) size = std::max(size, norm(b.frame.size()));

  auto model =
      make_mechanics(state.body.hex, scene.material, scene.lattice.formulation, state.materials, loaded.materials);
  if (!model) return model.error();
  state.model = std::move(*model);
  KERF_TRY(sync_all(state.body.hex, state.materials, state.model, state.mechanics));
  KERF_TRY(state.model.validate());
  uncut.filled.assign(state.model.materials().size(), 0.0);
  for (const HexId h : ids<HexId>(state.body.hex.hex_count()))
    if (state.body.hex.alive(h))
      uncut.filled[static_cast<std::size_t>(state.model.element(h).material)] += state.body.hex.material[h].mass_volume;

  step_options.dt = scene.simulation.time_step;
  step_options.gravity = state.gravity = scene.simulation.gravity;
  step_options.tolerance = scene.simulation.tolerance;
  step_options.max_iterations = scene.simulation.max_iterations;
  // Small bodies are done before a second thread wakes up; the bits are the same either way.
  step_options.parallel = scene.simulation.threads != 1 && state.model.node_count() > kParallelNodes;
  switch (scene.simulation.preconditioner) {
    case ScenePreconditioner::kAdaptive: step_options.preconditioner = Preconditioner::kAdaptive; break;
    case ScenePreconditioner::kTwoLevel: step_options.preconditioner = Preconditioner::kTwoLevel; break;
    case ScenePreconditioner::kBlockJacobi: step_options.preconditioner = Preconditioner::kBlockJacobi; break;
    case ScenePreconditioner::kDirect: step_options.solver = SolverKind::kDirect; break;
  }

  for (const SceneRigidTool& tool : scene.tools) {
    state.tools.push_back(tool_at_start(tool));
    state.mechanics.tools.push_back(tool_state(tool));
  }
  KERF_TRY(prepare_contact(scene, state.body, said.texts, contact));
  for (std::size_t i = 0; i < scene.fixes.size(); ++i)
    KERF_TRY(fix(scene.fixes[i].region,
                 fmt::format("{}[[fix]] number {}", scene_place(scene, scene.fixes[i].region.line), i + 1)));
  if (!scene.bonds.empty()) {
    auto made = make_bonds(scene, state.body, state.model, said.texts);
    if (!made) return made.error();
    bonds = std::move(*made);
    list_root_triangles(state.body.complex.collision, root_triangles);
    std::vector<BondPoint> points;
    for (const BondPlace& place : bonds.places) points.push_back(bond_point(state.body, place, root_triangles));
    KERF_TRY(state.model.set_bonds(bonds.laws, std::move(points)));
    state.mechanics.bond_damage.assign(bonds.places.size(), 0);
  }
  KERF_TRY(renew_springs());
  renew_loads();
  note_idle_parts();
  make_room();
  mark_synced();
  return {};
}

void Session::Impl::make_room() {
  state.body.for_each_array([](auto& a) {
    const std::size_t extra = std::clamp(a.size(), kLeastReserve, kMostReserve);
    a.reserve_touched(extra, extra);
  });
}

Result<SessionStep> Session::step() {
  Impl& s = *impl_;
  const auto start = Clock::now();
  SessionStep report;
  const std::uint64_t version = s.state.topology_version;
  const double dt = s.step_options.dt;
  const double until = s.state.time + dt;

  // A command belongs to the step that ends nearest after it; half a step of slack for rounding of time.
  while (s.state.next_command < s.scene.commands.size() &&
         s.scene.commands[s.state.next_command].at < until - 0.5 * dt) {
    const SceneCommand& command = s.scene.commands[s.state.next_command];
    ++s.state.next_command;  // one that fails is not tried again at every step
    KERF_TRY(s.apply_due(command));
  }
  if (s.state.stroke && s.state.stroke->from_command) KERF_TRY(s.advance_command_stroke(until));
  auto mechanics = s.advance();
  if (!mechanics)
    return failed(
        mechanics.error().message);  // whatever it was that could not be computed with: the scene was accepted
  report.mechanics = *mechanics;
  s.note_slowing(report.mechanics);
  report.parts = s.parts;
  report.detection = s.detection_seconds;
  s.forces_of = s.state.topology_version;
  ++s.state.steps;
  s.state.time = static_cast<double>(s.state.steps) * dt;  // no drift
  report.topology_changed = version != s.state.topology_version;
  report.seconds = seconds_since(start);
  return report;
}

Status Session::step(int n) {
  for (int i = 0; i < n; ++i)
    if (auto one = step(); !one) return one.error();
  return {};
}

double Session::time() const { return impl_->state.time; }
double Session::time_step() const { return impl_->step_options.dt; }

Status Session::apply(const SceneCommand& command) { return impl_->apply(command); }
Status Session::begin_stroke(SceneFrame frame, bool through) { return impl_->begin_stroke(frame, through); }
Status Session::move_blade(Vec3 base, Vec3 tip) { return impl_->move_blade({base, tip}); }
Status Session::end_stroke() { return impl_->end_stroke(); }
void Session::lift_blade() { impl_->lift_blade(); }
Status Session::cancel_stroke() { return impl_->cancel_stroke(); }
bool Session::in_stroke() const { return impl_->state.stroke != nullptr; }
Status Session::undo() { return impl_->undo(); }
Status Session::redo() { return impl_->redo(); }
int Session::undo_depth() const { return static_cast<int>(impl_->state.undo.size()); }
int Session::redo_depth() const { return static_cast<int>(impl_->state.redo.size()); }

std::shared_ptr<const SessionSnapshot> Session::snapshot() const {
  auto snapshot = std::make_shared<SessionSnapshot>();
  snapshot->state = impl_->state;
  snapshot->uncut = impl_->uncut;
  snapshot->said = impl_->said;
  return snapshot;
}
void Session::restore(const std::shared_ptr<const SessionSnapshot>& snapshot) {
  KERF_ASSERT(snapshot != nullptr);
  const std::uint64_t version = impl_->state.topology_version;
  impl_->state = snapshot->state;
  impl_->state.topology_version = version + 1;  // whoever watches must look again
  impl_->state_is_another();
}
void Session::Impl::state_is_another() {
  step_options.gravity = state.gravity;
  skin_stale = true;
  springs_stale = true;
  all_bonds_follow();
  forget_places();
  forget_held();
  piece_labels.forget();
  contact.surface_stale = true;
  // A cut drops the walls that it changes, and all of them where it does not know the surface they stand on.
  if (contact.on && !state.touching.walls.empty()) refresh_surface(state.body, contact);
  watched.everything = watching;
  positions_changed();
}

const Scene& Session::scene() const { return impl_->scene; }
const Body& Session::body() const { return impl_->state.body; }
std::uint64_t Session::topology_version() const { return impl_->state.topology_version; }
void Session::watch_changes(bool on) {
  impl_->watching = on;
  impl_->watched = {};
}
SessionChanges Session::take_changes() { return std::exchange(impl_->watched, {}); }
const std::vector<Vec3>& Session::node_positions() const { return impl_->state.mechanics.positions; }
const std::vector<Vec3>& Session::node_velocities() const { return impl_->state.mechanics.velocities; }
const std::vector<Vec3>& Session::collision_positions() { return impl_->deformed_collision(); }
void Session::shown_nodes(std::vector<Vec3>& positions) const {
  add_offsets(impl_->state.mechanics.positions, impl_->state.fade.nodes.offset, positions);
}
std::vector<Vec3> Session::visual_positions() const {
  const SessionState& s = impl_->state;
  std::vector<Vec3> nodes;
  shown_nodes(nodes);
  const VisualMesh& mesh = s.body.complex.visual;
  std::vector<Vec3> positions(mesh.vertex_count());
  for (const VisualVertex v : ids<VisualVertex>(positions.size())) {
    const HexId copy = s.body.embedding.visual[v];
    positions[v.index()] = point_position(s.body.hex, {copy, s.body.hex.local(copy, mesh.rest[v])}, nodes);
  }
  for (const FadingVertex& f : s.fade.visual) positions[static_cast<std::size_t>(f.vertex)] += f.offset;
  for (const VisualVertex v : impl_->held_visual()) positions[v.index()] = mesh.rest[v];
  return positions;
}

std::vector<Vec3> Session::visual_velocities() const {
  const SessionState& s = impl_->state;
  std::vector<Vec3> nodes;
  add_offsets(s.mechanics.velocities, s.fade.nodes.velocity, nodes);
  const VisualMesh& mesh = s.body.complex.visual;
  std::vector<Vec3> velocities(mesh.vertex_count());
  for (const VisualVertex v : ids<VisualVertex>(velocities.size())) {
    const HexId copy = s.body.embedding.visual[v];
    velocities[v.index()] = point_position(s.body.hex, {copy, s.body.hex.local(copy, mesh.rest[v])}, nodes);
  }
  for (const FadingVertex& f : s.fade.visual) velocities[static_cast<std::size_t>(f.vertex)] += f.velocity;
  for (const VisualVertex v : impl_->held_visual()) velocities[v.index()] = {};
  return velocities;
}

std::vector<Vec3> Session::collision_velocities() const {
  const SessionState& s = impl_->state;
  std::vector<Vec3> velocities(s.body.complex.collision.vertex_count()), nodes;
  add_offsets(s.mechanics.velocities, s.fade.nodes.velocity, nodes);
  kerf::collision_positions(s.body.hex, s.body.embedding, nodes, velocities);
  for (const FadingVertex& f : s.fade.collision) velocities[static_cast<std::size_t>(f.vertex)] += f.velocity;
  for (const CollisionVertex v : impl_->held_collision()) velocities[v.index()] = {};
  return velocities;
}

std::span<const FadingVertex> Session::fading_visual() const { return impl_->beside_visual(); }
std::span<const VisualVertex> Session::held_visual() const { return impl_->held_visual(); }

void Session::visual_skin(std::vector<Vec3f>& positions, std::vector<Vec3f>& normals) {
  Impl& s = *impl_;
  const Body& body = s.state.body;
  if (s.skin_stale) {
    s.skin = {};
    build_skin(body.complex, body.hex, body.embedding, s.skin);
    s.skin_stale = false;
  } else {
    refresh_skin(body.complex, body.hex, body.embedding, s.skin);
  }
  positions.resize(body.complex.visual.vertex_count());
  normals.resize(body.complex.visual.vertex_count());
  evaluate_skin(body.hex, s.skin, s.shown_nodes(), positions, normals);
  for (const FadingVertex& f : s.state.fade.visual) {
    Vec3f& p = positions[static_cast<std::size_t>(f.vertex)];
    p = to_float(to_double(p) + f.offset);
  }
  for (const VisualVertex v : s.held_visual()) {
    positions[v.index()] = to_float(body.complex.visual.rest[v]);
    normals[v.index()] = body.complex.visual.normal[v];
  }
}
const std::vector<StrokeRecord>& Session::strokes() const { return impl_->state.strokes; }
const std::vector<std::string>& Session::notes() const { return impl_->said.texts; }

BodyCounts Session::counts() const { return count_body(impl_->state.body); }

Vec3 Session::support_force() const {
  const Impl& s = *impl_;
  Vec3 sum;
  for (const NodeId n : ids<NodeId>(s.state.model.node_count())) sum += s.force_on_fixed(n);
  if (s.forces_of != s.state.topology_version) return sum;
  sum -= impl_->force_on_held();
  for (const SpringId spring : s.hold_springs) {
    if (!s.state.model.has_spring(spring)) continue;
    const std::array<double, 8>& weights = s.state.model.spring(spring).weights;
    sum +=
        std::accumulate(weights.begin(), weights.end(), 0.0) * spring_force(s.state.model, s.state.mechanics, spring);
  }
  return sum;
}

bool Session::is_fixed(NodeId node) const { return impl_->state.model.is_fixed(node); }

bool Session::stays_at_rest(Vec3 rest) const {
  const HeldRegions& held = impl_->state.materials.held;
  return held.cross && held.contains(rest);
}

Vec3 Session::support_force(NodeId node) const {
  const Impl& s = *impl_;
  Vec3 sum = s.force_on_fixed(node);
  if (s.forces_of != s.state.topology_version) return sum;
  for (const SpringId id : s.hold_springs) {
    if (!s.state.model.has_spring(id)) continue;
    const RowSpring& spring = s.state.model.spring(id);
    for (std::size_t k = 0; k < spring.nodes.size(); ++k)
      if (spring.nodes[k] == node) sum += spring.weights[k] * spring_force(s.state.model, s.state.mechanics, id);
  }
  return sum;
}

Vec3 Session::Impl::force_on_fixed(NodeId node) const {
  // What the last step left belongs to the nodes that there were then.
  if (forces_of != state.topology_version || !state.model.is_fixed(node) || !state.body.hex.active(node)) return {};
  return reaction(state.model, workspace, last_options, node);
}

Vec3 Session::Impl::force_on_held() {
  Vec3 sum = held_load;
  for (const Grasp& g : state.grasps)
    for (std::size_t i = 0; i < g.points.size(); ++i)
      if (stays(g.points[i])) sum += pull_of(g, i);
  const std::vector<ContactResult>& results = workspace.contact.results;
  if (!contact.on || results.size() != contact.held_share.size()) return sum;
  for (std::size_t i = 0; i < results.size(); ++i) sum += contact.held_share[i] * results[i].force;
  return sum;
}

Vec3 Session::grasp_force(const std::string& id) const {
  Vec3 sum;
  if (!impl_->fresh_springs()) return sum;
  for (const Grasp& g : impl_->state.grasps)
    if (g.id == id)
      for (std::size_t i = 0; i < g.springs.size(); ++i) sum += impl_->pull_of(g, i);
  return sum;
}

Status Session::validate() const {
  const Impl& s = *impl_;
  KERF_TRY(validate_complex(s.state.body.complex, s.state.measures));
  KERF_TRY(validate_piece_volumes(s.state.body.complex, s.state.measures));
  KERF_TRY(validate_lattice(s.state.body.complex.collision, s.state.body.hex));
  KERF_TRY(validate_lattice_pieces(s.state.body.complex.collision, s.state.body.hex));
  KERF_TRY(validate_embedding(s.state.body.complex, s.state.body.hex, s.state.body.embedding));
  for (std::size_t i = 0; i < s.state.mechanics.positions.size(); ++i)
    if (!is_finite(s.state.mechanics.positions[i]) || !is_finite(s.state.mechanics.velocities[i]))
      return failed(fmt::format("node {} has a position or velocity that is not finite", i));
  MechanicsModel& model = const_cast<MechanicsModel&>(s.state.model);  // total_mass refreshes derived data
  for (const NodeId n : ids<NodeId>(model.node_count()))
    if (model.is_fixed(n) && !(s.state.mechanics.velocities[n.index()] == model.prescribed_velocities()[n.index()]))
      return failed(fmt::format("node {} is fixed and moves", n.value));
  // Mass, material by material; mechanics has just the elements that live.
  double mass = 0;
  const HexMesh& hex = s.state.body.hex;
  for (const HexId h : ids<HexId>(hex.hex_count())) {
    if (hex.alive(h) != model.has_element(h))
      return failed(fmt::format("hexahedron {} and the elements of mechanics disagree", h.value));
    if (!hex.alive(h)) continue;
    const auto material = static_cast<std::size_t>(model.element(h).material);
    mass += model.materials()[material].density * hex.material[h].mass_volume;
  }
  if (std::abs(model.total_mass() - mass) > 1e-9 * mass)
    return failed(fmt::format("the nodes weigh {} kg together, the hexahedra {} kg", model.total_mass(), mass));
  double whole = 0;
  for (std::size_t i = 0; i < hex.bodies.size(); ++i)
    whole += model.materials()[s.state.materials.of(static_cast<std::int32_t>(i))].density * hex.bodies[i].volume;
  // What is left after removals may weigh less than the rounding of what was there.
  double densest = 0;
  for (const Material& m : model.materials()) densest = std::max(densest, m.density);
  double boxes = 0;
  for (const LatticeBody& b : hex.bodies) boxes += b.frame.size().x * b.frame.size().y * b.frame.size().z;
  const double rounding = 1e-13 * densest * boxes;
  if (s.state.materials.regions.empty() && std::abs(mass - whole) > std::max(1e-9 * whole, rounding))
    return failed(fmt::format("the hexahedra weigh {} kg, the body {} kg", mass, whole));
  if (s.state.mechanics.positions.size() != hex.node_count() || s.state.mechanics.rotations.size() != hex.hex_count())
    return failed("mechanics and the hexahedra have different numbers of nodes or elements");
  return s.validate_bonds();
}

Session::BondState Session::bonds() const {
  Impl& s = *impl_;
  s.renew_bonds();  // after a cut, undo or restore they may be of what was there before
  BondState out;
  out.points = s.bonds.places.size();
  for (std::size_t p = 0; p < out.points; ++p) {
    const double area = s.bonds.places[p].area;
    out.area += area;
    if (s.state.mechanics.bond_damage[p] < 1) continue;
    ++out.torn;
    out.torn_area += area;
  }
  if (out.points > 0) out.stored = bond_energy(s.state.model, s.state.mechanics);
  out.dissipated = s.state.mechanics.bond_dissipated;
  return out;
}

const std::vector<double>& Session::bond_damage() const { return impl_->state.mechanics.bond_damage; }

std::vector<Vec3> Session::bond_places() const {
  std::vector<Vec3> out;
  for (const BondPlace& place : impl_->bonds.places) out.push_back(place.rest);
  return out;
}

std::uint64_t Session::hash() const {
  const SessionState& state = impl_->state;
  Hash hash;
  hash.add(body_hash(state.body));
  hash.add(state.mechanics.positions);
  hash.add(state.mechanics.velocities);
  hash.add(state.mechanics.rotations);
  hash.add(state.mechanics.two_level_steps);
  hash.add(state.mechanics.tools);
  hash.add(state.mechanics.contacts);
  if (!state.mechanics.bond_damage.empty()) {
    hash.add(state.mechanics.bond_damage);
    hash.add(state.mechanics.bond_dissipated);
  }
  for (const RememberedContact& c : state.touching.contacts) {
    hash.add(c.key);
    hash.add(c.normal);
    hash.add(c.feature);
    hash.add(std::array<double, 2>{c.allowed, c.gap});
  }
  hash.add(state.touching.cut);
  for (const RememberedRim& r : state.touching.rims) {
    hash.add(std::array<std::int32_t, 4>{r.tool, r.vertex.value, r.side, r.end});
    hash.add(std::array<double, 5>{r.beside[0], r.beside[1], r.deep[0], r.deep[1], r.open});
  }
  for (const auto* list : {&state.touching.flanks, &state.touching.passing})
    for (const ToolContact& c : *list) {
      hash.add(c.key);
      hash.add(c.tool);
    }
  for (const SunkWall& w : state.touching.walls) {
    hash.add(std::array<std::int32_t, 4>{w.edge.value, w.out.edge.value, w.out.side, w.held ? 1 : 0});
    hash.add(std::array<double, 3>{w.along, w.lift, w.depth});
  }
  hash.add(state.gravity);
  hash.add(state.fade.nodes.offset);
  hash.add(state.fade.nodes.velocity);
  for (const auto* list : {&state.fade.visual, &state.fade.collision})
    for (const FadingVertex& f : *list) {
      hash.add(f.vertex);
      hash.add(std::array<Vec3, 2>{f.offset, f.velocity});
    }
  hash.add(state.steps);
  hash.add(std::uint64_t{state.next_command});
  for (std::size_t i = 0; i < state.model.node_count(); ++i) hash.add(state.model.is_fixed(NodeId(i)) ? 1 : 0);
  if (state.materials.held.cross)  // else nodes say all
    for (const HeldRegions::Change& change : state.materials.held.changes) {
      const SceneRegion& r = change.region;
      hash.add(std::array<std::int32_t, 2>{change.held ? 1 : 0, static_cast<std::int32_t>(r.shape)});
      hash.add(std::array<Vec3, 5>{r.min, r.max, r.center, r.point, r.normal});
      hash.add(r.radius);
    }
  for (const Grasp& g : state.grasps) {
    hash.add(g.points);
    hash.add(g.offset);
    hash.add(std::array<Vec3, 4>{g.centre, g.from, g.to, g.local});
    hash.add(std::array<Mat3, 2>{g.axes_then, g.turned});
    hash.add(std::array<double, 3>{g.move_began, g.move_over, g.stiffness});
  }
  for (const ToolMotion& t : state.tools) {
    hash.add(t.start);
    hash.add(t.poses);
    hash.add(std::array<double, 5>{t.began, t.jaws_from, t.jaws_to, t.jaws_began, t.jaws_over});
    hash.add(std::array<std::int32_t, 7>{t.inside, t.in_slit, t.holding, t.placed, t.pressed, t.jaw_pushes[0],
                                         t.jaw_pushes[1]});
    hash.add(std::array<Vec3, 7>{t.base, t.tip, t.press, t.force, t.torque, t.resistance, t.resistance_torque});
    hash.add(std::array<double, 2>{t.edge_force, t.edge_length});
  }
  return hash.value();
}

}  // namespace kerf
