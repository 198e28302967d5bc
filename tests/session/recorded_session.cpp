#include "session/recorded_session.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "kerf/base/hash.h"
#include "kerf/mesh/whole_file.h"
#include "kerf/scene/scene_file.h"
#include "kerf/session/body.h"
#include "session/continuity.h"

namespace kerf::test {

using Kind = SessionChange::Kind;

std::uint64_t fingerprint(const Session& session) {
  Hash hash;
  hash.add(body_hash(session.body()));
  hash.add(session.node_positions());
  hash.add(session.node_velocities());
  hash.add(session.visual_positions());
  hash.add(session.visual_velocities());
  return hash.value();
}

Result<RecordedSession> RecordedSession::create(const std::string& scene_text, const std::string& name) {
  Recording recording;
  recording.source.text = scene_text;
  recording.source.name = name;
  recording.instructions = instruction_set();
  const auto scene = scene_of(recording.source, recording.overrides);
  if (!scene) return scene.error();
  auto session = Session::create(*scene);
  if (!session) return session.error();
  RecordedSession out(std::move(*session));
  out.recording_ = std::move(recording);
  return out;
}

void RecordedSession::note(SessionChange change) {
  change.step = step_count();
  recording_.changes.push_back(std::move(change));
}

Status RecordedSession::noted(SessionChange change, const std::function<Status()>& what) {
  note(std::move(change));
  return what();
}

Result<PunchReport> RecordedSession::punch(const Punch& p, SceneFrame frame, double roughness) {
  SessionChange change{0,
                       Kind::kPunch,
                       {},
                       {},
                       {frame == SceneFrame::kRest ? 1.0 : 0.0, std::isfinite(p.reach) ? p.reach : -1, roughness}};
  for (const Vec3 v : {p.centre, p.axis, p.across}) change.values.insert(change.values.end(), {v.x, v.y, v.z});
  for (const Vec2 c : p.outline) change.values.insert(change.values.end(), {c.x, c.y});
  note(std::move(change));
  return Session::punch(p, frame, roughness);
}

Result<ShaveReport> RecordedSession::shave(const Shaver& s, SceneFrame frame, double smoothing, double depth) {
  note({0,
        Kind::kShave,
        {},
        {},
        {frame == SceneFrame::kRest ? 1.0 : 0.0, s.base.x, s.base.y, s.base.z, s.tip.x, s.tip.y, s.tip.z, s.radius,
         smoothing, depth}});
  return Session::shave(s, frame, smoothing, depth);
}

Result<RemovalReport> RecordedSession::remove_piece(CollisionTriangle triangle) {
  note({0, Kind::kRemove, {}, {triangle.value}, {}});
  return Session::remove_piece(triangle);
}

Result<SessionStep> RecordedSession::step() {
  tried_ = step_count() + 1;
  return Session::step();
}

Status RecordedSession::step(int n) {
  for (int i = 0; i < n; ++i)
    if (auto done = step(); !done) return done.error();
  return {};
}

Status RecordedSession::begin_stroke(SceneFrame frame, bool through) {
  return noted({0, Kind::kBeginStroke, {}, {}, {through ? 1.0 : 0.0, frame == SceneFrame::kRest ? 1.0 : 0.0}},
               [&] { return Session::begin_stroke(frame, through); });
}

Status RecordedSession::move_blade(Vec3 base, Vec3 tip) {
  return noted({0, Kind::kBlade, {}, {}, {base.x, base.y, base.z, tip.x, tip.y, tip.z}},
               [&] { return Session::move_blade(base, tip); });
}

Status RecordedSession::set_gravity(Vec3 gravity) {
  return noted({0, Kind::kGravity, {}, {}, {gravity.x, gravity.y, gravity.z}},
               [&] { return Session::set_gravity(gravity); });
}

Status RecordedSession::apply(const SceneCommand& command) {
  const Status done = Session::apply(command);
  const auto held = [&](const std::string& id) -> std::optional<GraspState> {
    for (const GraspState& g : grasps())
      if (g.id == id) return g;
    return {};
  };
  if (const auto* grasp = std::get_if<SceneGrasp>(&command.what)) {
    SessionChange change{0, Kind::kGrasp, grasp->id, {}, {}};
    if (const auto g = held(grasp->id))
      for (const CollisionVertex v : g->points) change.vertices.push_back(v.value);
    note(change);
  } else if (const auto* move = std::get_if<SceneMove>(&command.what)) {
    const auto g = held(move->id);
    const Vec3 to = move->to ? *move->to : g ? g->target : Vec3{};
    note({0, Kind::kMove, move->id, {}, {to.x, to.y, to.z, move->over}});
  } else if (const auto* release = std::get_if<SceneRelease>(&command.what)) {
    note({0, Kind::kRelease, release->id, {}, {}});
  } else if (const auto* fix = std::get_if<SceneFixCommand>(&command.what)) {
    note(region_change(Kind::kFix, fix->region));
  } else if (const auto* unfix = std::get_if<SceneUnfix>(&command.what)) {
    note(region_change(Kind::kUnfix, unfix->region));
  }
  return done;
}

std::shared_ptr<const SessionSnapshot> RecordedSession::snapshot() {
  marks_.emplace_back(Session::snapshot(), recording_.changes.size());
  return marks_.back().first;
}

void RecordedSession::restore(const std::shared_ptr<const SessionSnapshot>& snapshot) {
  Session::restore(snapshot);
  for (const auto& [mark, size] : marks_)
    if (mark == snapshot) recording_.changes.resize(size);
  tried_ = step_count();
}

Recording RecordedSession::recording() const {
  Recording out = recording_;
  out.last_step = std::max(step_count(), tried_);
  return out;
}

namespace {

/// Plays changes and keeps book of what undo, redo and cancel must bring back.
class Player {
 public:
  explicit Player(Session& session) : session_(session) {
    Box3 box;
    for (const Vec3 p : session.collision_positions()) box.add(p);
    size_ = box.diagonal();
  }

  std::optional<Problem> change(const SessionChange& c) {
    // What ends a stroke on its way ends it here, so that the books are simple.
    const bool another =
        c.kind == Kind::kShave && session_.in_stroke() && session_.strokes().back().kind != StrokeRecord::Kind::kShave;
    const bool ends = c.kind == Kind::kBeginStroke || c.kind == Kind::kUndo || c.kind == Kind::kRedo ||
                      c.kind == Kind::kPunch || c.kind == Kind::kRemove || another;
    if (ends && session_.in_stroke())
      if (auto problem = end_stroke()) return problem;
    const std::uint64_t now = fingerprint(session_);
    const int depth = session_.undo_depth();
    const bool in_stroke = session_.in_stroke();
    if (c.kind == Kind::kEndStroke) return end_stroke();
    const bool cuts =
        session_.step_count() > 0 && (c.kind == Kind::kBlade || c.kind == Kind::kPunch || c.kind == Kind::kShave);
    const std::uint64_t version = session_.topology_version();
    SurfaceMotion before;
    if (cuts) before = surface_motion(session_);
    const Status done = apply(session_, c);
    if (cuts && done && session_.topology_version() != version)
      if (const Continuity jump = continuity(before, surface_motion(session_), size_, c.kind != Kind::kShave);
          !jump.broken.empty())
        return Problem{Problem::Kind::kJump, jump.broken, 0, 0};
    if (!done && c.kind == Kind::kPunch) {  // one that finds no way is refused, and leaves nothing behind
      if (fingerprint(session_) != now)
        return Problem{Problem::Kind::kCancelFails, "a punch that was refused left something behind", 0, 0};
    } else if (!done && done.error().kind == ErrorKind::kFailed) {
      return Problem{Problem::Kind::kFailure, done.error().message, 0, 0};
    }
    if (c.kind == Kind::kUndo && done) {
      if (before_.empty()) return Problem{Problem::Kind::kUndoFails, "undo of what nobody did", 0, 0};
      const std::uint64_t wanted = before_.back();
      before_.pop_back();
      if (wanted != kNotComparable && fingerprint(session_) != wanted)
        return Problem{Problem::Kind::kUndoFails, "undo did not bring back the state before", 0, 0};
      undone_.push_back(now);
    } else if (c.kind == Kind::kRedo && done) {
      if (undone_.empty()) return Problem{Problem::Kind::kRedoFails, "redo of what nobody undid", 0, 0};
      const std::uint64_t wanted = undone_.back();
      undone_.pop_back();
      if (wanted != kNotComparable && fingerprint(session_) != wanted)
        return Problem{Problem::Kind::kRedoFails, "redo did not bring back the state before undo", 0, 0};
      before_.push_back(now);
    } else if (c.kind == Kind::kCancelStroke && done && in_stroke) {
      if (begun_ != kNotComparable && fingerprint(session_) != begun_)
        return Problem{Problem::Kind::kCancelFails, "a cancelled stroke left something behind", 0, 0};
    } else if (session_.undo_depth() > depth) {
      before_.push_back(now);
      undone_.clear();
    }
    if (c.kind == Kind::kFix || c.kind == Kind::kUnfix) {
      std::fill(before_.begin(), before_.end(), kNotComparable);
      std::fill(undone_.begin(), undone_.end(), kNotComparable);
      begun_ = kNotComparable;
    }
    if (!in_stroke && session_.in_stroke()) begun_ = now, begun_depth_ = depth;
    if (session_.redo_depth() == 0) undone_.clear();
    return check();
  }

  std::optional<Problem> step() {
    const auto done = session_.step();
    if (!done) return Problem{Problem::Kind::kFailure, done.error().message, 0, 0};
    return check();
  }

 private:
  std::optional<Problem> end_stroke() {
    const bool in_stroke = session_.in_stroke();
    const Status done = session_.end_stroke();
    if (!done) return Problem{Problem::Kind::kFailure, done.error().message, 0, 0};
    if (in_stroke && session_.undo_depth() > begun_depth_) before_.push_back(begun_);
    if (session_.redo_depth() == 0) undone_.clear();
    return check();
  }
  std::optional<Problem> check() {
    const Status valid = session_.validate();
    if (valid) return {};
    return Problem{Problem::Kind::kInvariant, valid.error().message, 0, 0};
  }

  Session& session_;
  double size_ = 1;
  std::vector<std::uint64_t> before_, undone_;
  std::uint64_t begun_ = 0;
  int begun_depth_ = 0;
};

/// From the first change of a unit to behind its last: a whole stroke, or one change.
std::vector<std::pair<std::size_t, std::size_t>> units(const std::vector<SessionChange>& changes) {
  std::vector<std::pair<std::size_t, std::size_t>> out;
  for (std::size_t i = 0; i < changes.size();) {
    std::size_t end = i + 1;
    if (changes[i].kind == Kind::kBeginStroke)
      while (end < changes.size() && changes[end].kind != Kind::kBeginStroke) {
        const bool last = changes[end].kind == Kind::kEndStroke || changes[end].kind == Kind::kCancelStroke;
        ++end;
        if (last) break;
      }
    out.emplace_back(i, end);
    i = end;
  }
  return out;
}

}  // namespace

std::optional<Problem> problem_in(const Recording& recording) {
  const auto scene = scene_of(recording.source, recording.overrides);
  if (!scene) return {};
  auto session = Session::create(*scene);
  if (!session) return {};
  Player player(*session);
  std::size_t next = 0;
  for (std::int64_t step = 0;; ++step) {
    for (; next < recording.changes.size() && recording.changes[next].step <= step; ++next)
      if (auto problem = player.change(recording.changes[next])) {
        problem->change = next + 1;
        problem->step = step;
        return problem;
      }
    if (step >= recording.last_step) return {};
    if (auto problem = player.step()) {
      problem->change = next;
      problem->step = step + 1;
      return problem;
    }
  }
}

Recording shrunk(const Recording& recording, Problem::Kind kind,
                 const std::function<std::optional<Problem>(const Recording&)>& find, std::chrono::seconds most) {
  const auto end = std::chrono::steady_clock::now() + most;
  const auto time_is_up = [&] { return std::chrono::steady_clock::now() > end; };
  Recording best = recording;
  // Taken over when it has the problem, without what comes after it.
  const auto accept = [&](Recording candidate) {
    const auto problem = find(candidate);
    if (!problem || problem->kind != kind) return false;
    candidate.changes.resize(std::min(candidate.changes.size(), problem->change));
    candidate.last_step = std::min(candidate.last_step, problem->step);
    best = std::move(candidate);
    return true;
  };
  if (!accept(best)) return recording;
  for (bool better = true; better && !time_is_up();) {
    better = false;
    for (const bool whole : {true, false}) {
      const auto parts = [&] {
        if (whole) return units(best.changes);
        std::vector<std::pair<std::size_t, std::size_t>> single;
        for (std::size_t i = 0; i < best.changes.size(); ++i) single.emplace_back(i, i + 1);
        return single;
      };
      for (std::size_t chunk = std::max<std::size_t>(1, parts().size() / 2); !time_is_up(); chunk /= 2) {
        for (std::size_t i = 0; i < parts().size() && !time_is_up();) {
          const auto list = parts();
          Recording candidate = best;
          const std::size_t last = std::min(i + chunk, list.size()) - 1;
          candidate.changes.erase(candidate.changes.begin() + static_cast<std::ptrdiff_t>(list[i].first),
                                  candidate.changes.begin() + static_cast<std::ptrdiff_t>(list[last].second));
          if (accept(std::move(candidate))) better = true;
          else i += chunk;
        }
        if (chunk == 1) break;
      }
    }
    // Fewer steps between changes, and before the end.
    for (std::size_t i = 0; i <= best.changes.size() && !time_is_up(); ++i) {
      const std::int64_t from = i == 0 ? 0 : best.changes[i - 1].step;
      const std::int64_t to = i < best.changes.size() ? best.changes[i].step : best.last_step;
      for (std::int64_t less = to - from; less > 0 && !time_is_up(); less /= 2) {
        Recording candidate = best;
        for (std::size_t k = i; k < candidate.changes.size(); ++k) candidate.changes[k].step -= less;
        candidate.last_step -= less;
        if (accept(std::move(candidate))) {
          better = true;
          break;
        }
      }
    }
  }
  return best;
}

std::string keep_shrunk(const Recording& recording, const std::string& name) {
  const auto problem = problem_in(recording);
  Recording small = recording;
  if (problem) small = shrunk(recording, problem->kind, problem_in, std::chrono::seconds(60));
  const char* folder = std::getenv("KERF_FUZZ_OUT");
  const std::string file = (std::filesystem::path(folder ? folder : ".") / (name + ".kerfrec")).string();
  if (const Status written = replace_file(file, recording_text(small)); !written) return written.error().message;
  if (!problem) return "played again it does not fail; all of it: " + file;
  return std::to_string(recording.changes.size()) + " changes shrunk to " + std::to_string(small.changes.size()) +
         ": " + file + " (" + problem->what + "); when it is mended, the file belongs into tests/regressions";
}

}  // namespace kerf::test
