// Shaving: passes of a shaver over cut surfaces, and everything that follows the moved vertices.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "kerf/base/stopwatch.h"
#include "kerf/cutting/half_edge_split.h"
#include "kerf/cutting/wall_points.h"
#include "kerf/session/session_impl.h"

namespace kerf {
namespace {

/// Of collision vertices in one pass, so that a frame of shaving never takes long; what is left comes first in the next.
constexpr int kMostMoves = 10;

/// Normals of what is drawn, where vertices have moved: those of the skin as interpolated, those of walls from their faces. Appends
/// the render vertices that get another one.
void renew_normals(const CellComplex& complex, const std::vector<VisualVertex>& moved, CutScratch& scratch,
                   RenderSurface& surface, std::vector<RenderVertex>& changed) {
  const VisualMesh& mesh = complex.visual;
  const auto face_vector = [&](VisualTriangle f) {
    const VisualHalfEdge h = VisualMesh::corner(f, 0);
    const Vec3 a = mesh.rest[mesh.from(h)];
    return cross(mesh.rest[mesh.to(h)] - a, mesh.rest[mesh.apex(h)] - a);
  };
  DenseIndex &seen = scratch.slid_vertex, &done = scratch.slid_face;
  seen.reset(mesh.vertex_count());
  done.reset(surface.normal.size());
  std::vector<VisualVertex> around;
  const auto add = [&](VisualVertex v) {
    if (seen.insert(v.value) == static_cast<std::int32_t>(around.size())) around.push_back(v);
  };
  for (const VisualVertex v : moved) {
    add(v);
    cut::for_each_corner(mesh, v, [&](VisualHalfEdge h) {
      add(mesh.to(h));
      return true;
    });
  }
  for (const VisualVertex v : around) {
    const RenderVertex skin = surface.skin[v];
    if (skin.valid() && !(surface.normal[skin] == mesh.normal[v])) {
      surface.normal.set(skin, mesh.normal[v]);
      changed.push_back(skin);
    }
    cut::for_each_corner(mesh, v, [&](VisualHalfEdge h) {
      const Patch patch = mesh.patch[VisualMesh::face(h)];
      const RenderVertex r = surface.corner[h];
      if (!patch.is_wall() || !r.valid() || done.find(r.value) >= 0) return true;
      done.insert(r.value);
      Vec3 sum;
      cut::for_each_corner(mesh, v, [&](VisualHalfEdge k) {
        if (surface.corner[k] == r) sum += face_vector(VisualMesh::face(k));
        return true;
      });
      const Vec3f normal = to_float(normalized(sum));
      if (norm(sum) > 0 && !(surface.normal[r] == normal)) {
        surface.normal.set(r, normal);
        changed.push_back(r);
      }
      return true;
    });
  }
}

}  // namespace

void Session::Impl::set_account(BodyAccount account) {
  state.measures = account.measures;
  state.body.hex.bodies = std::move(account.bodies);
}

Result<ShaveReport> Session::Impl::shave(const Shaver& shaver, SceneFrame frame, double smoothing, double depth) {
  if (!is_finite(shaver.base) || !is_finite(shaver.tip) || !(shaver.radius > 0 && std::isfinite(shaver.radius)))
    return bad_input("shaver: its ends must be finite, its radius above 0");
  if (!(smoothing >= 0 && smoothing <= 1) || !(depth >= 0 && std::isfinite(depth)))
    return bad_input(fmt::format("shaver: smoothing must lie in [0, 1] and depth must not be negative, not {} and {}",
                                 smoothing, depth));
  if (!bonds.empty()) return bad_input(kBondedStays);
  const auto start = Clock::now();
  if (state.stroke && !state.stroke->shaving) {
    KERF_TRY(finish_stroke());
  }
  if (!state.stroke) {
    KERF_TRY(begin_stroke(frame, true));
    state.stroke->shaving = true;
    state.strokes.back().kind = StrokeRecord::Kind::kShave;
  }
  Body& body = state.body;
  forget_places();
  place_for_sweep(frame);
  const std::size_t vertices = body.complex.collision.vertex_count();
  begin_pose();
  ShavePass pass;
  kerf::shave(body.complex, sweep_positions, shaver,
              {smoothing, depth, kMostMoves, state.stroke->shave_left, state.stroke->shave_until}, cut_options,
              cut_scratch, pass);
  state.stroke->shave_until = state.stroke->shave_left;
  state.stroke->shave_left = pass.left;
  forget_places();
  ShaveReport report;
  report.edges = pass.edges;
  report.moved_back = pass.moved_back;
  report.stuck = pass.stuck;
  report.removed = pass.removed;
  report.roughness_before = pass.roughness_before;
  report.roughness_after = pass.roughness_after;
  const bool changed = !pass.vertices.empty() || pass.turned > 0 || body.complex.collision.vertex_count() != vertices;
  StrokeRecord& record = state.strokes.back();
  if (changed) {
    state.measures.volume -= pass.removed;
    state.measures.skin_area += pass.skin_area;
    state.measures.collision_area += pass.collision_area;
    for (const CollisionVertex v : pass.collision_vertices)
      if (v.index() < body.hex.prism_corner.size())
        body.hex.prism_corner.set(v, corners_of(body.complex.collision, body.hex, v));
    for (const auto& [root, change] : pass.prisms) {
      LatticeBody& owner = body.hex.bodies[static_cast<std::size_t>(body.hex.body_of(root))];
      owner.volume += owner.scale * change;
    }
    // Everything that moved is looked up anew, in its present cell.
    for (const VisualVertex v : pass.vertices)
      if (v.index() < body.embedding.visual.size()) body.embedding.visual.set(v, HexId{});
    for (const CollisionVertex v : pass.collision_vertices)
      if (v.index() < body.embedding.collision.size()) body.embedding.collision.set(v, HexId{});
    CutTimes following;
    if (const Status followed = follow_complex(following); !followed) {
      const Status cancelled = cancel_stroke();
      KERF_ASSERT(cancelled.ok());
      (void)cancelled;
      return followed.error();
    }
    std::vector<CollisionTriangle> owners;
    const auto add_around = [&](CollisionVertex v) {
      cut::for_each_corner(body.complex.collision, v, [&](CollisionHalfEdge k) {
        owners.push_back(CollisionMesh::face(k));
        return true;
      });
    };
    for (const WallId w : pass.walls) {
      const CollisionHalfEdge h = body.complex.wall_edge[w];
      add_around(body.complex.collision.from(h));
      add_around(body.complex.collision.to(h));
    }
    for (const CollisionVertex v : pass.collision_vertices) add_around(v);
    std::sort(owners.begin(), owners.end());
    owners.erase(std::unique(owners.begin(), owners.end()), owners.end());
    moved.clear();
    embed_triangles(body.complex, body.hex, owners, body.embedding, embedding_scratch, moved);
    if (moved_ever()) {
      remember_change(surface_state(), state.synced, surface);
      let_nothing_jump();
    }
    note_moved(skin, pass.vertices);
    std::vector<RenderVertex> other_normals;
    renew_normals(body.complex, pass.vertices, cut_scratch, body.surface, other_normals);
    if (watching) {
      watched.moved.insert(watched.moved.end(), pass.vertices.begin(), pass.vertices.end());
      watched.moved.insert(watched.moved.end(), moved.begin(), moved.end());
      watched.render_vertices.insert(watched.render_vertices.end(), other_normals.begin(), other_normals.end());
    }
    // Passes write to the same items again and again; what undo needs is where they began.
    (void)journal_compact(body, state.stroke->start);
    mark_synced();
    state.stroke->shaved = true;
    ++state.topology_version;
    positions_changed();
    record.times.embedding += following.embedding;
  }
  report.seconds = seconds_since(start);
  record.ended = state.time;
  record.triangles += pass.edges;
  record.times.total += report.seconds;
  record.times.cut_surface += report.seconds;
  cut_scratch.wall_seconds = 0;
  return report;
}

Status Session::Impl::begin_shave(const SceneShave& what, const std::string& place) {
  KERF_TRY(finish_command_stroke());
  if (what.poses.empty() || !(what.radius > 0) || !(what.smoothing >= 0) || !(what.removal >= 0))
    return bad_input("shave: it needs poses, a radius above 0, and rates that are not negative");
  KERF_TRY(begin_stroke(what.frame, true));
  ActiveStroke& stroke = *state.stroke;
  stroke.shaving = stroke.from_command = true;
  stroke.shave = what;
  stroke.place = place;
  stroke.command_began = state.time;
  state.strokes.back().kind = StrokeRecord::Kind::kShave;
  return {};
}

Status Session::Impl::advance_command_shave(double until) {
  // The command's data go with the stroke when it ends.
  const SceneShave what = state.stroke->shave;
  const double t = until - state.stroke->command_began, dt = step_options.dt;
  const double smoothing = 1 - std::exp(-what.smoothing * dt), depth = what.removal * dt;
  const auto pass = [&](Vec3 base, Vec3 tip) {
    const auto done = shave({base, tip, what.radius}, what.frame, smoothing, depth);
    return done ? Status{} : Status(done.error());
  };
  std::size_t& next = state.stroke->next_pose;
  while (next < what.poses.size() && what.poses[next].time <= t + 1e-12) {
    KERF_TRY(pass(what.poses[next].base, what.poses[next].tip));
    ++next;
  }
  if (next == what.poses.size()) return end_stroke();
  if (next == 0) return {};
  const SceneBladePose& a = what.poses[next - 1];
  const SceneBladePose& b = what.poses[next];
  const double s = (t - a.time) / (b.time - a.time);
  return s > 1e-9 ? pass(lerp(a.base, b.base, s), lerp(a.tip, b.tip, s)) : Status{};
}

Result<ShaveReport> Session::shave(const Shaver& shaver, SceneFrame frame, double smoothing, double depth) {
  return impl_->shave(shaver, frame, smoothing, depth);
}

double Session::roughness() const {
  const CellComplex& complex = impl_->state.body.complex;
  std::vector<WallId> walls;
  for (const WallId w : ids<WallId>(complex.wall_edge.size())) walls.push_back(w);
  return wall_roughness(complex, walls);
}

}  // namespace kerf
