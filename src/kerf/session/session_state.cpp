// The state of a session as bytes, and back.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "kerf/base/bytes.h"
#include "kerf/session/session_impl.h"

namespace kerf {
namespace {

Error damaged(const char* what) {
  return bad_input(fmt::format("this is not the state of a session, or it is damaged ({}); save it anew", what));
}

/// All of a state that goes on, but the records of strokes. Undo steps don't, nor what follows from the rest.
template <class Archive, class State>
void visit_state(Archive& a, State& s) {
  a(s.body.complex.closed), a(s.body.complex.mean_root_edge), a(s.body.hex.bodies);
  s.body.for_each_array([&a](auto& array) { a(array); });
  s.model.for_each_part([&a](auto& part) { a(part); });
  a(s.mechanics), a(s.fade);
  a(s.materials.regions), a(s.materials.held.changes), a(s.materials.held.cross), a(s.materials.held.cells);
  a(s.measures), a(s.gravity), a(s.largest_tool_force), a(s.time), a(s.steps), a(s.next_command);
  a(s.grasps), a(s.lost_grasps), a(s.tools), a(s.seen), a(s.touching), a(s.topology_version);
}

/// How many there are of each kind that has arrays of its own. Pools are of several lengths.
struct Counts {
  std::unordered_map<const char*, std::size_t> of_kind;
  bool agree = true;
  template <class I, class T>
  void operator()(const Journaled<I, T>& array) {
    if constexpr (!std::is_same_v<I, PoolIndex> && !std::is_same_v<I, LatticePoolIndex>) {
      const auto [known, added] = of_kind.try_emplace(&bytes::IdTag<I>::kind, array.size());
      agree = agree && (added || known->second == array.size());
    }
  }
  template <class I>
  [[nodiscard]] std::size_t of() const {
    const auto found = of_kind.find(&bytes::IdTag<I>::kind);
    return found == of_kind.end() ? 0 : found->second;
  }
};

template <class I>
bool ids_exist(const ByteReader& reader, const Counts& counts) {
  const std::int32_t greatest = reader.greatest_id<I>();
  return greatest < 0 || static_cast<std::size_t>(greatest) < counts.of<I>();
}
template <class... I>
bool all_ids_exist(const ByteReader& reader, const Counts& counts) {
  return (ids_exist<I>(reader, counts) && ...);
}

/// Runs of a pool lie in it.
template <class Run>
bool lies_in(const Run& run, std::size_t pool) {
  return run.first >= -1 && run.count >= -1 && (run.count <= 0 || run.first >= 0) &&
         std::int64_t{run.first} + std::max(run.count, 0) <= static_cast<std::int64_t>(pool);
}
template <class I, class Run>
bool lie_in(const Journaled<I, Run>& runs, std::size_t pool) {
  return std::all_of(runs.raw().begin(), runs.raw().end(), [pool](const Run& run) { return lies_in(run, pool); });
}
template <class I, class Run>
bool lie_in(const Journaled<I, std::array<Run, 2>>& runs, std::size_t pool) {
  return std::all_of(runs.raw().begin(), runs.raw().end(),
                     [pool](const std::array<Run, 2>& two) { return lies_in(two[0], pool) && lies_in(two[1], pool); });
}

template <class T>
bool same_bytes(const T& a, const T& b) {
  std::string one, other;
  ByteWriter{one}(a), ByteWriter{other}(b);
  return one == other;
}

/// The bodies that they are of: shaving changes their volume, nothing changes the rest.
bool same_bodies(const Body& a, const Body& b) {
  std::vector<LatticeBody> bodies = a.hex.bodies;
  for (std::size_t i = 0; i < bodies.size() && i < b.hex.bodies.size(); ++i) {
    if (!std::isfinite(bodies[i].volume)) return false;
    bodies[i].volume = b.hex.bodies[i].volume;
  }
  return a.complex.closed == b.complex.closed && same_bytes(a.complex.mean_root_edge, b.complex.mean_root_edge) &&
         same_bytes(bodies, b.hex.bodies);
}

/// Which numbers of the body mean nothing that is there; null: all do.
const char* fault_of(const Body& body, const ByteReader& reader, const Counts& counts, std::size_t roots) {
  const CollisionMesh& c = body.complex.collision;
  const VisualMesh& v = body.complex.visual;
  const HexMesh& h = body.hex;
  if (!counts.agree || counts.of<CollisionHalfEdge>() != 3 * counts.of<CollisionTriangle>() ||
      counts.of<VisualHalfEdge>() != 3 * counts.of<VisualTriangle>())
    return "counts";
  if (counts.of<CellId>() != h.cell_count() || counts.of<LatticeFaceId>() != 3 * h.cell_count()) return "cells";
  if (!all_ids_exist<CollisionVertex, CollisionHalfEdge, CollisionTriangle, VisualVertex, VisualHalfEdge,
                     VisualTriangle, WallId, HexId, NodeId, CellId, TipId, RenderVertex>(reader, counts))
    return "ids";
  for (const RootId root : c.root.raw())
    if (!root.valid() || root.index() >= roots) return "roots";
  for (const Patch patch : v.patch.raw())
    if (patch.is_wall() ? patch.wall().index() >= counts.of<WallId>()
                        : patch.value < 0 || patch.root().index() >= roots)
      return "patches";
  for (const LatticeIndex& cell : h.cell.raw())
    if (!h.contains(cell)) return "hexahedra";
  for (const HexState state : h.state.raw())
    if (state != HexState::kDead && state != HexState::kAbsorbed && state != HexState::kAlive) return "hexahedra";
  for (const HexMaterial& material : h.material.raw())
    if (material.body < 0 || static_cast<std::size_t>(material.body) >= h.bodies.size()) return "bodies";
  const bool lie = lie_in(c.chain, body.complex.chain_pool.size()) && lie_in(c.line, body.complex.chain_pool.size()) &&
                   lie_in(c.free, body.complex.free_pool.size()) &&
                   lie_in(body.complex.wall_inner, body.complex.wall_pool.size()) &&
                   lie_in(h.members, h.member_pool.size()) && lie_in(h.links, h.link_pool.size()) &&
                   lie_in(h.pieces, h.piece_pool.size()) && h.piece_moments.size() == h.piece_pool.size();
  return lie ? nullptr : "pools";
}

/// What else of it does not fit to the body, or to the scene of a session that has another state of it.
const char* fault_of(const SessionState& state, const SessionState& other, const Scene& scene) {
  const MechanicsState& m = state.mechanics;
  const std::size_t nodes = state.body.hex.node_count(), copies = state.body.hex.hex_count();
  if (state.model.node_count() != nodes || m.positions.size() != nodes || m.velocities.size() != nodes) return "nodes";
  if (m.rotations.size() != copies || state.model.element_count() > copies) return "elements";
  if (state.tools.size() != scene.tools.size() || m.tools.size() != scene.tools.size()) return "tools";
  if (m.bond_damage.size() != other.mechanics.bond_damage.size() ||
      state.model.bond_points().size() != other.model.bond_points().size())
    return "bonds";
  if (state.model.materials().size() != other.model.materials().size() ||
      state.materials.regions.size() != other.materials.regions.size())
    return "materials";
  if (state.next_command > scene.commands.size() || state.steps < 0) return "time";
  const NodeFade& fade = state.fade.nodes;
  if (fade.offset.size() != fade.velocity.size() || fade.offset.size() > nodes) return "what fades";
  for (const Grasp& g : state.grasps)
    if (g.offset.size() != g.points.size()) return "grasps";
  return nullptr;
}

std::string way_out_of(const ActiveStroke& stroke) {
  if (stroke.tool >= 0)
    return "a tool is cutting, and half a cut can't be saved; lead its edge out of the body, and save then";
  if (stroke.from_command) return "a stroke of the scene is under way, and half a cut can't be saved; save after it";
  return "a stroke is open, and half a cut can't be saved; end or cancel it, and save then";
}

Result<std::string> bytes_of(const UncutBodies& uncut, const SessionState& the_state, const SessionNotes& said) {
  if (the_state.stroke) return bad_input(way_out_of(*the_state.stroke));
  std::string out;
  ByteWriter writer(out);
  writer(uncut.volume), writer(uncut.filled);
  SessionState& state = const_cast<SessionState&>(the_state);  // a writer only reads; arrays are listed for both
  visit_state(writer, state);
  std::vector<StrokeRecord> strokes = state.strokes;
  for (StrokeRecord& record : strokes)
    record.times = {}, record.removed.seconds = 0;  // no clock: same life, same bytes
  writer(strokes);
  writer(state.model.given_matrices());
  writer(said);
  return out;
}

}  // namespace

Result<std::string> Session::state_bytes() const { return bytes_of(impl_->uncut, impl_->state, impl_->said); }
Result<std::string> Session::state_bytes(const SessionSnapshot& snapshot) {
  return bytes_of(snapshot.uncut, snapshot.state, snapshot.said);
}

Status Session::take_state(std::string_view bytes) {
  Impl& s = *impl_;
  ByteReader reader(bytes);
  std::vector<double> volume, filled, given;
  reader(volume), reader(filled);
  if (!reader.ok()) return damaged("its beginning");
  if (volume != s.uncut.volume || filled != s.uncut.filled)
    return bad_input(
        "this state is of another body: what the scene makes or reads is not what it was when the state was saved; bring the mesh files as they were");
  SessionState state;
  visit_state(reader, state);
  reader(state.strokes);
  reader(given);
  SessionNotes said;
  reader(said);
  if (!reader.ok() || reader.left() > 0) return damaged("its length");
  if (!same_bodies(state.body, s.state.body)) return damaged("bodies");
  Counts counts;
  state.body.for_each_array(counts);
  if (const char* fault = fault_of(state.body, reader, counts, s.uncut.roots)) return damaged(fault);
  if (!state.model.adopt_parts(given)) return damaged("mechanics");
  if (const char* fault = fault_of(state, s.state, s.scene)) return damaged(fault);

  for (Grasp& g : state.grasps) g.springs.resize(g.points.size());  // they are renewed before anybody looks
  if (!state.materials.held.changes.empty()) state.materials.held.trace(state.body.hex);
  state.topology_version =
      std::max(state.topology_version, s.state.topology_version) + 1;  // whoever watches must look again
  std::swap(s.state, state);
  if (const Status valid = validate(); !valid) {
    std::swap(s.state, state);
    return damaged(valid.error().message.c_str());
  }
  s.said = std::move(said);
  s.state_is_another();
  s.make_room();
  s.mark_synced();
  return {};
}

}  // namespace kerf
