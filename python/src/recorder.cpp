#include "recorder.h"

#include <algorithm>
#include <type_traits>
#include <utility>
#include <variant>

namespace kerf::python {
namespace {

using Kind = SessionChange::Kind;

constexpr std::size_t kMostBytes = std::size_t{64} << 20;  // of changes, as the page's recordings (EngineOptions)

void put(std::vector<double>& values, Vec3 v) { values.insert(values.end(), {v.x, v.y, v.z}); }

SessionChange punch_change(const Session& session, const ScenePunch& punch) {
  SessionChange c;
  c.kind = Kind::kPunch;
  c.values = {(punch.frame == SceneFrame::kRest ? 1.0 : 0.0) + (punch.take ? 2.0 : 0.0), punch.reach.value_or(-1),
              punch.roughness};
  put(c.values, punch.point);
  put(c.values, punch.axis);
  put(c.values, punch.across);
  for (const Vec2 corner : session.outline_of(punch)) c.values.insert(c.values.end(), {corner.x, corner.y});
  return c;
}

std::optional<Session::GraspState> held(Session& session, const std::string& id) {
  for (Session::GraspState& g : session.grasps())
    if (g.id == id) return std::move(g);
  return {};
}

}  // namespace

Result<Recorder> Recorder::begin(SceneSource source, const Session& session, bool scripted) {
  Recorder out;
  out.frame_.source = std::move(source);
  KERF_TRY(take_meshes(session.scene(), out.frame_.source));
  out.frame_.overrides.scripted = scripted;
  out.frame_.overrides.dust = session.scene().cut.dust;
  out.frame_.instructions = instruction_set();
  out.notes_.hashes.push_back({0, session.hash()});
  return out;
}

void Recorder::note(const Session& session, SessionChange change) {
  if (!notes_.trouble.empty()) return;
  if (const Status fits = check(change); !fits) return give_up(fits.error().message);
  change.step = session.step_count();
  notes_.bytes += sizeof change + change.id.capacity() + 4 * change.vertices.size() + 8 * change.values.size();
  if (notes_.bytes > kMostBytes) {
    notes_ = {};
    return give_up("more happened than a recording holds; record a shorter session");
  }
  notes_.changes.push_back(std::move(change));
}

void Recorder::before(Session& session, const SceneCommand& command) {
  in_stroke_ = session.in_stroke();
  to_remove_.reset();
  no_change_.clear();
  const auto no_change = [&](const char* why) { no_change_ = why; };
  std::visit(
      [&](const auto& what) {
        using What = std::decay_t<decltype(what)>;
        if constexpr (std::is_same_v<What, SceneBlade> || std::is_same_v<What, SceneShave>) {
          no_change(
              "a blade or shaver that moves by itself is no change; use stroke() or cut(), or write it into the scene");
        } else if constexpr (std::is_same_v<What, ScenePunch>) {
          note(session, punch_change(session, what));
        } else if constexpr (std::is_same_v<What, SceneUndo> || std::is_same_v<What, SceneRedo>) {
          for (int i = 0; i < what.count; ++i)
            note(session, std::is_same_v<What, SceneUndo> ? Kind::kUndo : Kind::kRedo);
        } else if constexpr (std::is_same_v<What, SceneRelease>) {
          note(session, {0, Kind::kRelease, what.id, {}, {}});
        } else if constexpr (std::is_same_v<What, SceneFixCommand>) {
          note(session, region_change(Kind::kFix, what.region));
        } else if constexpr (std::is_same_v<What, SceneUnfix>) {
          note(session, region_change(Kind::kUnfix, what.region));
        } else if constexpr (std::is_same_v<What, SceneJaws>) {
          note(session, {0, Kind::kJaws, what.id, {}, {what.close ? 1.0 : 0.0, what.over}});
        } else if constexpr (std::is_same_v<What, SceneToolMotion>) {
          if (what.poses.size() != 1)
            return no_change("a tool's way of several poses is no change; lead it pose by pose");
          SessionChange c{0, Kind::kTool, what.id, {}, {}};
          put(c.values, what.poses[0].position);
          put(c.values, what.poses[0].rotation);
          c.values.push_back(what.poses[0].time);
          note(session, std::move(c));
        } else if constexpr (std::is_same_v<What, SceneRemove>) {
          const CollisionMesh& mesh = session.body().complex.collision;
          if (const auto grasp = held(session, what.grasp)) {
            for (const CollisionVertex v : grasp->points)
              if (mesh.rest.contains(v)) to_remove_ = CollisionMesh::face(mesh.outgoing[v]).value;
          } else if (what.grasp.empty() && what.frame == SceneFrame::kWorld) {
            note(session, region_change(Kind::kSuck, what.region));
          } else if (what.grasp.empty()) {
            no_change("a removal by a region at rest is no change; give the region in the world");
          }
        } else if constexpr (std::is_same_v<What, SceneGrasp>) {
          if (what.stiffness) no_change("a grasp's own stiffness is no part of a change; leave it out");
        }
      },
      command.what);
}

void Recorder::after(Session& session, const SceneCommand& command, const Status& done) {
  if (!done) {
    if (in_stroke_ && !session.in_stroke()) give_up("a command that failed ended a stroke");
    return;
  }
  if (!no_change_.empty()) return give_up(no_change_);
  if (const auto* grasp = std::get_if<SceneGrasp>(&command.what)) {
    SessionChange c{0, Kind::kGrasp, grasp->id, {}, {}};
    if (const auto g = held(session, grasp->id))
      for (const CollisionVertex v : g->points) c.vertices.push_back(v.value);
    note(session, std::move(c));
  } else if (const auto* move = std::get_if<SceneMove>(&command.what)) {
    const auto g = held(session, move->id);
    if (!g) return;  // it was lost: nothing moved
    SessionChange c{0, Kind::kMove, move->id, {}, {}};
    put(c.values, move->to.value_or(g->target));
    c.values.push_back(move->over);
    note(session, std::move(c));
  } else if (to_remove_) {
    if (session.strokes().back().removed.pieces != 1) return give_up("what the grasp held was more than one piece");
    note(session, {0, Kind::kRemove, {}, {*to_remove_}, {}});
  }
}

void Recorder::stepped(const Session& session, bool done) {
  if (!done) return give_up("a step failed");
  if (notes_.trouble.empty() && session.step_count() % kHashEvery == 0)
    notes_.hashes.push_back({session.step_count(), session.hash()});
}

Result<Recording> Recorder::recording(const Session& session) const {
  if (!notes_.trouble.empty()) return bad_input("this session can't be recorded: " + notes_.trouble);
  Recording out = frame_;
  out.changes = notes_.changes;
  out.hashes = notes_.hashes;
  out.last_step = session.step_count();
  out.end_hash = session.hash();
  return out;
}

}  // namespace kerf::python
