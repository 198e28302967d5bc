// Loose pieces are taken away: grasped, sucked off or picked; which takes the dust of strokes (session_dust.cpp) out, too.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "kerf/base/shown_text.h"
#include "kerf/base/stopwatch.h"
#include "kerf/lattice/lattice_remove.h"
#include "kerf/session/session_impl.h"
#include "kerf/spatial/triangle_queries.h"

namespace kerf {
namespace {

constexpr double kNothingLeft = 1e-9;  // of a body's volume: rounding of sums over its cells

void keep_embedding(Embedding& e, const ComplexRenaming& r, const LatticeRenaming& l) {
  keep_items(e.visual, r.visual_vertex, l.copy);
  keep_items(e.collision, r.collision_vertex, l.copy);
  keep_items(e.collision_local, r.collision_vertex);
}

void keep_surface(RenderSurface& s, const ComplexRenaming& r) {
  const auto drawn =
      id_map<RenderVertex>(s.vertex.size(), [&](RenderVertex v) { return r.visual_vertex.keeps(s.vertex[v]); });
  keep_items(s.vertex, drawn, r.visual_vertex);
  keep_items(s.patch, drawn, [&](Patch p) { return p.is_wall() ? Patch::of_wall(r.wall(p.wall())) : p; });
  keep_items(s.normal, drawn);
  keep_items(s.skin, r.visual_vertex, drawn);
  keep_items(s.corner, r.visual_half_edge, drawn);
}

template <class Id>
void keep_fades(std::vector<FadingVertex>& list, const IdMap<Id>& map) {
  for (FadingVertex& f : list) f.vertex = map(Id(f.vertex)).value;
  std::erase_if(list, [](const FadingVertex& f) { return f.vertex < 0; });
}

/// Does a triangle reach into a region? Exact for balls and half-spaces; for boxes it looks at nine points of the triangle and at
/// the point nearest to the box's middle.
bool meets_region(const SceneRegion& region, Vec3 a, Vec3 b, Vec3 c) {
  ClosestPoint nearest;
  const Vec3 middle = region.shape == SceneRegion::Shape::kBox ? 0.5 * (region.min + region.max) : region.center;
  closest_point(middle, {a, b, c}, nearest);
  const auto inner = [&](double u, double v) { return region.contains(u * a + v * b + (1 - u - v) * c); };
  return region.contains(a) || region.contains(b) || region.contains(c) || region.contains(nearest.point) ||
         inner(0.5, 0.5) || inner(0, 0.5) || inner(0.5, 0) || inner(1.0 / 3, 1.0 / 3) || inner(0.6, 0.2) ||
         inner(0.2, 0.6);
}

}  // namespace

std::vector<std::int32_t> Session::Impl::pieces_of_copies(const Pieces& pieces) const {
  const Body& body = state.body;
  std::vector<std::int32_t> piece_of_copy(body.hex.hex_count(), -1);
  for (const CollisionTriangle t : ids<CollisionTriangle>(body.complex.collision.face_count()))
    for (const Piece& p : body.hex.pieces_of(t))
      piece_of_copy[body.hex.host[p.copy].index()] = pieces.of_face[t.index()];
  return piece_of_copy;
}

double Session::Impl::mass_of(HexId copy) const {
  return state.model.materials()[static_cast<std::size_t>(state.model.element(copy).material)].density *
         state.body.hex.material[copy].mass_volume;
}

std::vector<double> Session::Impl::masses_of(const Pieces& pieces) const {
  const HexMesh& hex = state.body.hex;
  const std::vector<std::int32_t> piece_of_copy = pieces_of_copies(pieces);
  std::vector<double> mass(static_cast<std::size_t>(pieces.count), 0.0);
  for (const HexId h : ids<HexId>(hex.hex_count()))
    if (hex.alive(h) && piece_of_copy[h.index()] >= 0)
      mass[static_cast<std::size_t>(piece_of_copy[h.index()])] += mass_of(h);
  return mass;
}

PieceMasses Session::piece_masses() const {
  const Impl& s = *impl_;
  const HexMesh& hex = s.state.body.hex;
  const Pieces pieces = collision_pieces(s.state.body.complex);
  const std::vector<std::int32_t> piece_of_copy = s.pieces_of_copies(pieces);
  std::vector<double> mass(static_cast<std::size_t>(pieces.count), 0.0);
  std::vector<HexId> copy(mass.size());
  for (const HexId h : ids<HexId>(hex.hex_count())) {
    if (!hex.alive(h) || piece_of_copy[h.index()] < 0) continue;
    const auto p = static_cast<std::size_t>(piece_of_copy[h.index()]);
    mass[p] += s.mass_of(h);
    if (!copy[p].valid()) copy[p] = h;
  }
  PieceMasses all;
  for (std::size_t p = 0; p < mass.size(); ++p) {
    if (!copy[p].valid()) continue;
    all.mass.push_back(mass[p]);
    all.copy.push_back(copy[p]);
  }
  for (std::size_t m = 0; m < s.uncut.filled.size(); ++m)
    all.uncut += s.state.model.materials()[m].density * s.uncut.filled[m];
  return all;
}

std::size_t PieceRemoval::bytes() const {
  std::size_t sum = fixed.size() + prescribed.size() * sizeof(Vec3) + to_other.size() * sizeof(CollisionVertex);
  const_cast<Body&>(body).for_each_array([&](const auto& a) { sum += a.size() * sizeof(a.raw()[0]); });
  return sum;
}

void Session::Impl::forget_ids() {
  cut_scratch = {};
  lattice_scratch = {};
  lattice_change.clear();
  embedding_scratch = {};
  topology_change = {};
  remembered.clear();
  skin_stale = true;
  forget_places();
  piece_labels.forget();
  contact.surface_stale = true;
  state.touching = {};
  state.seen.clear();
  watched.everything = watching;
  mark_synced();
  ++state.topology_version;
  positions_changed();
}

Status Session::Impl::rebuild_model(const std::vector<std::uint8_t>& fixed, const std::vector<Vec3>& prescribed) {
  const HexMesh& hex = state.body.hex;
  MechanicsModel model(state.model.cells()[0].size, state.model.cells()[0].axes, state.model.formulation());
  for (const ElementCell& cell : state.model.cells().subspan(1)) model.add_cell(cell);
  const std::span<const Material> materials = state.model.materials();
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(materials.size()); ++i)
    if (auto added = model.add_material(materials[static_cast<std::size_t>(i)], state.model.cell_of(i)); !added)
      return added.error();
  for (std::size_t i = 0; i < fixed.size(); ++i) {
    const LatticeIndex c = hex.corner[NodeId(i)];
    model.add_node(hex.rest(NodeId(i)), {c[0], c[1], c[2]});
    if (fixed[i]) model.fix_node(NodeId(i), prescribed[i]);
  }
  state.model = std::move(model);
  return sync_all(hex, state.materials, state.model, state.mechanics);
}

Status Session::Impl::swap_removal(PieceRemoval& r, bool back) {
  PieceRemoval now;
  now.held_changes = state.materials.held.changes.size();
  for (std::size_t i = 0; i < state.model.node_count(); ++i) {
    now.fixed.push_back(state.model.is_fixed(NodeId(i)) ? 1 : 0);
    now.prescribed.push_back(state.model.prescribed_velocities()[i]);
  }
  // Grasps follow the vertices that are in both.
  now.to_other.assign(state.body.complex.collision.vertex_count(), CollisionVertex{});
  for (std::size_t i = 0; i < r.to_other.size(); ++i)
    if (r.to_other[i].valid()) now.to_other[r.to_other[i].index()] = CollisionVertex(i);
  for (Grasp& g : state.grasps) {
    std::size_t kept = 0;
    for (std::size_t k = 0; k < g.points.size(); ++k) {
      const CollisionVertex v =
          g.points[k].index() < now.to_other.size() ? now.to_other[g.points[k].index()] : CollisionVertex{};
      if (!v.valid()) continue;
      g.points[kept] = v;
      g.offset[kept++] = g.offset[k];
    }
    g.points.resize(kept);
    g.offset.resize(kept);
  }
  if (back) {
    for (const auto& [place, removed] : r.grasps) {
      const Grasp& grasp = removed;  // lambdas capture no structured bindings
      const auto same =
          std::find_if(state.grasps.begin(), state.grasps.end(), [&](const Grasp& g) { return g.id == grasp.id; });
      if (same != state.grasps.end()) *same = grasp;
      else
        state.grasps.insert(state.grasps.begin() + static_cast<std::ptrdiff_t>(std::min(place, state.grasps.size())),
                            grasp);
      std::erase(state.lost_grasps, grasp.id);
    }
  } else {
    lose_empty_grasps();
  }
  now.grasps = std::move(r.grasps);
  now.body = std::move(state.body);
  now.measures = state.measures;
  state.body = std::move(r.body);
  state.measures = r.measures;
  const std::vector<std::uint8_t> fixed = std::move(r.fixed);
  const std::vector<Vec3> prescribed = std::move(r.prescribed);
  const std::size_t held_changes = r.held_changes;
  r = std::move(now);
  forget_ids();
  // The positions that belong to this body come with the undo step; these only have the right number.
  state.mechanics.positions.resize(state.body.hex.node_count());
  state.mechanics.velocities.resize(state.body.hex.node_count());
  state.mechanics.rotations.resize(state.body.hex.hex_count());
  KERF_TRY(rebuild_model(fixed, prescribed));
  return renew_held(held_changes);  // a support may be newer
}

Result<RemovalReport> Session::Impl::take_away(const std::vector<std::uint8_t>& triangles) {
  const auto start = Clock::now();
  RemovalReport report;
  KERF_ASSERT(!state.stroke);  // its end may rename the triangles
  const Pieces pieces = collision_pieces(state.body.complex);
  const std::vector<double> masses = masses_of(pieces);
  std::vector<std::uint8_t> goes(static_cast<std::size_t>(pieces.count), 0);
  for (std::size_t f = 0; f < triangles.size(); ++f)
    if (triangles[f]) goes[static_cast<std::size_t>(pieces.of_face[f])] = 1;
  for (std::size_t p = 0; p < goes.size(); ++p)
    if (goes[p]) {
      ++report.pieces;
      report.mass += masses[p];
    }
  if (report.pieces == 0) return report;
  if (report.pieces == pieces.count) return bad_input("the body is in one piece; only loose pieces can be taken away");
  std::vector<std::uint8_t> remove(triangles.size(), 0);
  for (std::size_t f = 0; f < remove.size(); ++f) remove[f] = goes[static_cast<std::size_t>(pieces.of_face[f])];

  StrokeRecord record;
  record.kind = StrokeRecord::Kind::kRemoval;
  record.began = record.ended = state.time;
  record.finished = true;
  record.before = counts();
  UndoStep step;
  step.mechanics = state.mechanics;
  step.fade = state.fade;
  const auto taken = take_out(remove, step.removal);
  if (!taken) return taken.error();
  report.volume = taken->removed.volume;
  report.share = share_of_uncut(report.volume);
  record.after = counts();
  report.seconds = seconds_since(start);
  record.times.total = report.seconds;
  record.removed = report;
  state.strokes.push_back(record);
  step.record = state.strokes.size() - 1;
  state.redo.clear();
  add_undo(std::move(step));
  return report;
}

Result<ComplexRenaming> Session::Impl::take_out(const std::vector<std::uint8_t>& remove,
                                                std::optional<PieceRemoval>& undo) {
  if (!bonds.empty()) return bad_input(kBondedStays);
  PieceRemoval before;
  before.body = state.body;
  before.measures = state.measures;
  before.held_changes = state.materials.held.changes.size();
  for (std::size_t i = 0; i < state.model.node_count(); ++i) {
    before.fixed.push_back(state.model.is_fixed(NodeId(i)) ? 1 : 0);
    before.prescribed.push_back(state.model.prescribed_velocities()[i]);
  }

  Body& body = state.body;
  const auto book = [&](double sign) {
    for (const HexId h : ids<HexId>(body.hex.hex_count()))
      if (body.hex.alive(h))
        body.hex.bodies[static_cast<std::size_t>(body.hex.material[h].body)].volume +=
            sign * body.hex.material[h].mass_volume;
  };
  book(-1);
  ComplexRenaming r = kerf::remove_pieces(body.complex, remove);
  const LatticeRenaming l = remove_from_lattice(body.hex, r.collision_vertex, r.collision_half_edge,
                                                r.collision_triangle, body.complex.collision);
  keep_embedding(body.embedding, r, l);
  keep_surface(body.surface, r);
  book(1);
  state.measures.skin_area -= r.removed.skin_area;
  state.measures.collision_area -= r.removed.collision_area;
  state.measures.volume -= r.removed.volume;

  MechanicsState kept_motion = state.mechanics;
  NodeFade kept_fade;
  kept_motion.positions.clear();
  kept_motion.velocities.clear();
  kept_motion.rotations.clear();
  std::vector<std::uint8_t> fixed;
  std::vector<Vec3> prescribed;
  for (const NodeId n : l.node.origins()) {
    kept_motion.positions.push_back(state.mechanics.positions[n.index()]);
    kept_motion.velocities.push_back(state.mechanics.velocities[n.index()]);
    kept_fade.set(NodeId(fixed.size()), state.fade.nodes.offset_of(n), state.fade.nodes.velocity_of(n));
    fixed.push_back(before.fixed[n.index()]);
    prescribed.push_back(before.prescribed[n.index()]);
  }
  for (const HexId h : l.copy.origins()) kept_motion.rotations.push_back(state.mechanics.rotations[h.index()]);
  state.mechanics = std::move(kept_motion);
  state.fade.nodes = std::move(kept_fade);
  keep_fades(state.fade.visual, r.visual_vertex);
  keep_fades(state.fade.collision, r.collision_vertex);

  for (std::size_t i = 0; i < r.collision_vertex.old_count(); ++i)
    before.to_other.push_back(r.collision_vertex(CollisionVertex(i)));
  for (std::size_t i = 0; i < state.grasps.size(); ++i) {
    Grasp& g = state.grasps[i];
    const bool loses =
        std::any_of(g.points.begin(), g.points.end(), [&](CollisionVertex v) { return !r.collision_vertex.keeps(v); });
    if (loses) before.grasps.emplace_back(i, g);
    std::size_t n = 0;
    for (std::size_t k = 0; k < g.points.size(); ++k)
      if (const CollisionVertex v = r.collision_vertex(g.points[k]); v.valid()) {
        g.points[n] = v;
        g.offset[n++] = g.offset[k];
      }
    g.points.resize(n);
    g.offset.resize(n);
  }
  lose_empty_grasps();
  for (EdgePress& press : edge_presses) press.vertex = r.collision_vertex(press.vertex);
  std::erase_if(edge_presses, [](const EdgePress& press) { return !press.vertex.valid(); });

  forget_ids();
  const bool divided = !r.new_ancestor.empty();
  if (divided) {
    // Where another vertex stands for an ancestor that has gone, prisms may be divided otherwise.
    std::vector<CollisionTriangle> around;
    for (const CollisionVertex v : r.new_ancestor)
      body.complex.collision.for_each_outgoing(v, [&](CollisionHalfEdge h) {
        around.push_back(CollisionMesh::face(h));
        return true;
      });
    adapt_lattice(body.complex.collision, body.hex, around, lattice_scratch, lattice_change);
    std::vector<VisualVertex> embedded_anew;
    embed_triangles(body.complex, body.hex, lattice_change.triangles, body.embedding, embedding_scratch, embedded_anew);
  }
  KERF_TRY(rebuild_model(fixed, prescribed));
  if (divided) {
    begin_pose();
    if (moved_ever()) {
      remember_change(surface_state(), state.synced, surface);
      let_nothing_jump();
    }
    (void)journal_take(body, state.synced);  // no undo step of its own
    mark_synced();
  }
  KERF_TRY(renew_springs());
  renew_loads();

  undo = std::move(before);
  return r;
}

Result<RemovalReport> Session::Impl::remove_in(const SceneRegion& region, SceneFrame frame) {
  KERF_TRY(finish_stroke());
  const CollisionMesh& mesh = state.body.complex.collision;
  const Pieces pieces = collision_pieces(state.body.complex);
  const std::vector<double> masses = masses_of(pieces);
  std::vector<std::uint8_t> loose(static_cast<std::size_t>(pieces.count), 1), meets(loose.size(), 0);
  loose[static_cast<std::size_t>(std::max_element(masses.begin(), masses.end()) - masses.begin())] = 0;
  const std::vector<Vec3>& places = frame == SceneFrame::kRest ? mesh.rest.raw() : deformed_collision();
  for (const CollisionTriangle t : ids<CollisionTriangle>(mesh.face_count())) {
    const auto p = static_cast<std::size_t>(pieces.of_face[t.index()]);
    if (!meets[p] && meets_region(region, places[mesh.origin[CollisionMesh::corner(t, 0)].index()],
                                  places[mesh.origin[CollisionMesh::corner(t, 1)].index()],
                                  places[mesh.origin[CollisionMesh::corner(t, 2)].index()]))
      meets[p] = 1;
    for (const Piece& piece : state.body.hex.pieces_of(t))
      if (is_held(state.body.hex, state.materials, state.model, state.body.hex.host[piece.copy])) loose[p] = 0;
  }
  std::vector<std::uint8_t> triangles(mesh.face_count(), 0);
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    const auto p = static_cast<std::size_t>(pieces.of_face[f]);
    triangles[f] = loose[p] && meets[p] ? 1 : 0;
  }
  return take_away(triangles);
}

Result<RemovalReport> Session::remove_piece(CollisionTriangle triangle) {
  const auto& root = impl_->state.body.complex.collision.root;
  if (!root.contains(triangle))
    return bad_input(fmt::format("there is no collision triangle {} to take away", triangle.value));
  KERF_TRY(impl_->finish_stroke());
  if (impl_->swept) triangle = impl_->swept->collision_triangle(triangle);
  if (!triangle.valid()) return RemovalReport{};
  std::vector<std::uint8_t> triangles(root.size(), 0);
  triangles[triangle.index()] = 1;
  return impl_->take_away(triangles);
}

bool Session::held_by_supports(CollisionTriangle triangle) const {
  const SessionState& s = impl_->state;
  const CollisionMesh& mesh = s.body.complex.collision;
  if (!triangle.valid() || triangle.index() >= mesh.face_count()) return false;
  const Pieces pieces = collision_pieces(s.body.complex);
  for (const CollisionTriangle t : ids<CollisionTriangle>(mesh.face_count())) {
    if (pieces.of_face[t.index()] != pieces.of_face[triangle.index()]) continue;
    for (const Piece& piece : s.body.hex.pieces_of(t))
      if (is_held(s.body.hex, s.materials, s.model, s.body.hex.host[piece.copy])) return true;
  }
  return false;
}

Result<RemovalReport> Session::remove_pieces(const SceneRegion& region, SceneFrame frame) {
  return impl_->remove_in(region, frame);
}

Result<RemovalReport> Session::Impl::take_grasped(const std::string& id) {
  const auto grasp = [&] {
    return std::find_if(state.grasps.begin(), state.grasps.end(), [&](const Grasp& g) { return g.id == id; });
  };
  const auto is_gone = [&] { return grasp() == state.grasps.end(); };
  if (!is_gone()) KERF_TRY(finish_stroke());
  if (is_gone()) return bad_input(fmt::format("there is no grasp '{}' that holds a piece", kerf::shown(id)));
  const CollisionMesh& mesh = state.body.complex.collision;
  std::vector<std::uint8_t> triangles(mesh.face_count(), 0);
  for (const CollisionVertex v : grasp()->points)
    if (mesh.rest.contains(v)) triangles[CollisionMesh::face(mesh.outgoing[v]).index()] = 1;
  return take_away(triangles);
}
Result<RemovalReport> Session::remove_grasped(const std::string& id) { return impl_->take_grasped(id); }

Status Session::Impl::remove(const SceneRemove& what, const std::string& place) {
  if (!what.grasp.empty() && note_lost_grasp(what.grasp, place, "remove")) return {};
  const std::vector<LatticeBody> before = state.body.hex.bodies;
  const auto done = what.grasp.empty() ? remove_in(what.region, what.frame) : take_grasped(what.grasp);
  if (!done) return done.error();
  if (done->pieces == 0)
    add_note(fmt::format("{}remove took nothing away: {}", place,
                         counts().pieces == 1
                             ? "the body is in one piece, and only loose pieces can go"
                             : "no loose piece reaches there; the heaviest piece and those that [[fix]] holds stay"));
  const std::vector<LatticeBody>& after = state.body.hex.bodies;
  for (std::size_t i = 0; i < std::min(before.size(), after.size()); ++i)
    if (before[i].volume > 0 && after[i].volume <= kNothingLeft * before[i].volume)
      add_note(fmt::format(
          "{}remove took all away that there was of {}; make its region smaller, or hold that body with [[fix]], if it should stay",
          place, name_of_body(static_cast<std::int32_t>(i))));
  return {};
}

}  // namespace kerf
