// A punch is a stroke that is over at once: one cut, one undo step.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "kerf/base/stopwatch.h"
#include "kerf/cutting/pieces.h"
#include "kerf/cutting/roughen.h"
#include "kerf/session/session_impl.h"
#include "kerf/session/tolerances.h"

namespace kerf {
namespace {

double area_of(const std::vector<Vec2>& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) twice += cross(polygon[i], polygon[(i + 1) % polygon.size()]);
  return 0.5 * std::fabs(twice);
}

/// Marks pieces that the bite has cut loose beside its outline, as between two bites at a rim: neither held, nor larger than the bite, nor
/// the largest of all.
void add_scraps(const Body& body, const BodyMaterials& materials, const MechanicsModel& model,
                const std::vector<CollisionHalfEdge>& lips, double bite, std::vector<std::uint8_t>& triangles) {
  const CollisionMesh& mesh = body.complex.collision;
  const Pieces pieces = collision_pieces(body.complex);
  std::vector<double> area(static_cast<std::size_t>(pieces.count), 0);
  std::vector<std::uint8_t> scrap(area.size(), 0);
  for (const CollisionHalfEdge h : lips)
    scrap[static_cast<std::size_t>(piece_of_triangle(pieces, CollisionMesh::face(h)))] = 1;
  for (const CollisionTriangle f : ids<CollisionTriangle>(mesh.face_count())) {
    const auto p = static_cast<std::size_t>(piece_of_triangle(pieces, f));
    const CollisionHalfEdge h = CollisionMesh::corner(f, 0);
    const Vec3 a = mesh.rest[mesh.from(h)];
    area[p] += 0.5 * norm(cross(mesh.rest[mesh.to(h)] - a, mesh.rest[mesh.apex(h)] - a));
    if (!scrap[p]) continue;
    for (const Piece& piece : body.hex.pieces_of(f))
      if (is_held(body.hex, materials, model, body.hex.host[piece.copy])) scrap[p] = 0;
  }
  scrap[static_cast<std::size_t>(std::max_element(area.begin(), area.end()) - area.begin())] = 0;
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    const auto p = static_cast<std::size_t>(pieces.of_face[f]);
    if (scrap[p] && area[p] < bite) triangles[f] = 1;
  }
}

}  // namespace

Result<PunchReport> Session::Impl::punch(const Punch& punch, SceneFrame frame, double roughness) {
  if (!(roughness >= 0 && std::isfinite(roughness)))
    return bad_input(fmt::format("punch: a roughness of {} m; it must not be negative", roughness));
  KERF_TRY(finish_stroke());
  const auto start = Clock::now();
  UndoList redo = std::exchange(state.redo, {});  // given back if nothing is cut
  KERF_TRY(begin_stroke(frame, true));
  const auto give_up = [&] {
    Status cancelled = cancel_stroke();
    state.redo = std::move(redo);
    return cancelled;
  };
  forget_places();
  place_for_sweep(frame);
  begin_pose();
  auto cut = cut_punch(state.body.complex, sweep_positions, punch, cut_options, cut_scratch);
  forget_places();
  if (!cut) {
    KERF_TRY(give_up());
    return cut.error();
  }
  PunchReport report;
  if (cut->opened_edges == 0) {
    KERF_TRY(give_up());
    report.surrounds = cut->surrounds;
    return report;
  }
  roughen_punch(state.body.complex, *cut, roughness, static_cast<std::uint64_t>(scene.simulation.seed));
  CutTimes following;
  if (const Status followed = follow_complex(following); !followed) {
    KERF_TRY(give_up());
    return followed.error();
  }
  end_pose();
  StrokeRecord& record = state.strokes.back();
  record.kind = StrokeRecord::Kind::kPunch;
  record.triangles = cut->opened_edges;
  record.refused = cut->retries;
  record.times.total = seconds_since(start);
  record.times.embedding = following.embedding;
  record.times.cut_surface = std::exchange(cut_scratch.wall_seconds, 0.0);
  record.times.cut_and_binding = record.times.total - record.times.embedding - record.times.cut_surface;
  report.cut = true;
  report.loose = std::move(cut->loose);
  report.lips = std::move(cut->lips);
  KERF_TRY(finish_stroke());
  if (swept) {
    const auto rename = [](auto& list, const auto& map) {
      for (auto& id : list) id = map(id);
      std::erase_if(list, [](auto id) { return !id.valid(); });
    };
    rename(report.loose, swept->collision_triangle);
    rename(report.lips, swept->collision_half_edge);
  }
  report.times = state.strokes.back().times;
  return report;
}

std::vector<Vec2> Session::Impl::outline_of(const ScenePunch& what) const {
  const double tolerance = kOutlineOfPath * cut_options.path_tolerance * state.body.complex.mean_root_edge;
  return what.shape == ScenePunchShape::kCircle ? circle_outline(what.radius, tolerance)
         : what.shape == ScenePunchShape::kD    ? d_outline(what.radius, tolerance)
                                                : what.points;
}

Status Session::Impl::punch(const ScenePunch& what, const std::string& place) {
  if (what.take && !bonds.empty()) return bad_input(kBondedStays);
  Punch p;
  p.centre = what.point;
  p.axis = what.axis;
  p.across = what.across;
  if (what.reach) p.reach = *what.reach;
  p.outline = outline_of(what);
  const auto done = punch(p, what.frame, what.roughness);
  if (!done) return done.error();
  if (!done->cut)
    add_note(fmt::format(
        "{}the punch cut nothing: its outline meets no material along its axis{} ({} coordinates, metres); {}", place,
        what.reach ? " within its reach" : "", what.frame == SceneFrame::kRest ? "rest" : "world",
        done->surrounds ? "it goes all around what lies inside: make it smaller" : "move its point onto the body"));
  else if (what.take && done->loose.empty() && !swept)
    add_note(fmt::format("{}the punch cut, but nothing came loose that could be taken away", place));
  if (!what.take || done->loose.empty()) return {};
  std::vector<std::uint8_t> triangles(state.body.complex.collision.face_count(), 0);
  for (const CollisionTriangle t : done->loose) triangles[t.index()] = 1;
  add_scraps(state.body, state.materials, state.model, done->lips, area_of(p.outline), triangles);
  const auto taken = take_away(triangles);
  return taken ? Status{} : Status(taken.error());
}

std::vector<Vec2> Session::outline_of(const ScenePunch& punch) const { return impl_->outline_of(punch); }
Result<PunchReport> Session::punch(const Punch& punch, SceneFrame frame, double roughness) {
  return impl_->punch(punch, frame, roughness);
}

}  // namespace kerf
