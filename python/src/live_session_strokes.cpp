// What is done to a session: strokes, commands, turns of a batch.
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "errors.h"
#include "interrupts.h"
#include "kerf/scene/scene_file.h"
#include "live_session.h"
#include "live_session_use.h"
#include "python_lock.h"

namespace kerf::python {
namespace {

using Kind = SessionChange::Kind;

// As a change has them.
std::vector<double> begin_values(SceneFrame frame, bool through) {
  return {through ? 1.0 : 0.0, frame == SceneFrame::kRest ? 1.0 : 0.0};
}
std::vector<double> edge_values(Vec3 base, Vec3 tip) { return {base.x, base.y, base.z, tip.x, tip.y, tip.z}; }

/// Does a stroke by hand go on while this is done? What cuts, takes away, undoes or does again would end it.
bool goes_with_stroke(const SceneCommand& command) {
  return std::visit(
      [](const auto& what) {
        using What = std::decay_t<decltype(what)>;
        return std::is_same_v<What, SceneGrasp> || std::is_same_v<What, SceneMove> ||
               std::is_same_v<What, SceneRelease> || std::is_same_v<What, SceneFixCommand> ||
               std::is_same_v<What, SceneUnfix> || std::is_same_v<What, SceneToolMotion> ||
               std::is_same_v<What, SceneJaws>;
      },
      command.what);
}

}  // namespace

// --- Strokes ---

bool LiveSession::is_open(std::uint64_t stroke) const {
  return stroke == stroke_ && session_->in_stroke() && session_->strokes().size() == stroke_record_;
}

void LiveSession::must_be_open(std::uint64_t stroke) const {
  if (stroke == 0)
    throw Failure(bad_input("this stroke has not begun; use `with`: with session.stroke() as blade: blade.move(...)"));
  if (!is_open(stroke)) throw Failure(bad_input("this stroke is over; begin another one"));
}

bool LiveSession::hand_has_cut() const { return session_->strokes().back().before != session_->counts(); }

void LiveSession::note_end_of_stroke() {
  if (!session_->in_stroke()) stroke_record_ = 0;
}

bool LiveSession::stroke_is_open(std::uint64_t stroke) {
  Use session(*this);
  return is_open(stroke);
}

std::uint64_t LiveSession::begin_stroke(SceneFrame frame, bool through) {
  Use session(*this);
  if (is_open(stroke_)) throw Failure(bad_input("a stroke is open; end it before the next one begins"));
  ++changes_;  // a blade of the scene that cuts ends here
  note(Kind::kBeginStroke, begin_values(frame, through));
  check(unlocked([&] { return session->begin_stroke(frame, through); }));
  stroke_record_ = session->strokes().size();
  return ++stroke_;
}

void LiveSession::move_blade(std::uint64_t stroke, Vec3 base, Vec3 tip) {
  Use session(*this);
  must_be_open(stroke);
  ++changes_;
  note(Kind::kBlade, edge_values(base, tip));
  const Status moved = unlocked([&] { return session->move_blade(base, tip); });
  note_end_of_stroke();
  check(moved);
}

void LiveSession::end_stroke(std::uint64_t stroke, bool keep) {
  Use session(*this);
  must_be_open(stroke);
  ++changes_;
  note(keep ? Kind::kEndStroke : Kind::kCancelStroke);
  const Status ended = unlocked([&] { return keep ? session->end_stroke() : session->cancel_stroke(); });
  note_end_of_stroke();
  check(ended);
}

bool LiveSession::cut(const double* edges, std::size_t poses, SceneFrame frame, bool through) {
  Use session(*this);
  if (is_open(stroke_)) throw Failure(bad_input("a stroke is open; end it before the next one begins"));
  ++changes_;
  Interrupts interrupts;
  Status done;
  bool met = false;
  {
    const WithoutPythonLock release;
    note(Kind::kBeginStroke, begin_values(frame, through));
    done = session->begin_stroke(frame, through);
    const bool begun = done.ok();
    const std::size_t record = session->strokes().size();
    for (std::size_t i = 0; i < poses && done.ok() && !interrupts.wanted(); ++i) {
      const double* edge = edges + 6 * i;
      note(Kind::kBlade, {edge, edge + 6});
      done = session->move_blade({edge[0], edge[1], edge[2]}, {edge[3], edge[4], edge[5]});
      session.let_look();
    }
    if (done.ok() && !interrupts.wanted()) {
      note(Kind::kEndStroke);
      done = session->end_stroke();
      if (done.ok()) met = session->strokes()[record - 1].before != session->strokes()[record - 1].after;
    }
    if (begun && session->in_stroke()) {
      note(Kind::kCancelStroke);
      const Status cancelled = session->cancel_stroke();
      if (done.ok()) done = cancelled;
    }
  }
  interrupts.raise();
  check(done);
  return met;
}

// --- Commands ---

Status LiveSession::perform(const SceneCommand& command) {
  if (recorder_) recorder_->before(*session_, command);
  const Status done = session_->apply(command);
  if (recorder_) recorder_->after(*session_, command, done);
  return done;
}

LiveSession::Applied LiveSession::apply(const std::string& text, const std::string& name) {
  Use session(*this);
  std::vector<SceneRigidTool> tools = session->scene().tools;
  const std::vector<Session::ToolState> states = session->tools();
  for (std::size_t i = 0; i < tools.size();
       ++i)  // a pose without rotation keeps the tool's, to the bit where that is the scene's
    if (turn(tools[i].rotation) != states[i].pose.axes) tools[i].rotation = turn_of(states[i].pose.axes);
  const SceneCommand command = value_of(parse_command(text, name, session->time(), tools));
  if (is_open(stroke_) && !goes_with_stroke(command))
    throw Failure(bad_input("a stroke is open; end it before this command"));
  ++changes_;
  const std::size_t before = session->strokes().size();
  const Status done = unlocked([&] { return perform(command); });
  note_end_of_stroke();
  check(done);
  Applied out;
  out.stroke = session->strokes().size() > before;
  for (std::size_t i = before; i < session->strokes().size(); ++i) out.removed += session->strokes()[i].removed.pieces;
  return out;
}

// --- In a batch ---

void LiveSession::take_turn(const SessionTurn& turn, std::uint64_t& stroke) {
  Use session(*this);
  ++changes_;
  const double over = static_cast<double>(turn.steps) * session->time_step();
  for (const auto& [id, target] : turn.grasps) {
    SceneCommand command;
    command.what = SceneMove{id, {}, target, over};
    check(perform(command));
  }
  for (const SessionTurn::Tool& tool : turn.tools) {
    SceneCommand command;
    command.what = SceneToolMotion{tool.id, {{over, tool.position, tool.rotation}}};
    check(perform(command));
  }
  const auto move = [&](double share) {
    const Vec3 base = lerp(turn.base[0], turn.base[1], share), tip = lerp(turn.tip[0], turn.tip[1], share);
    note(Kind::kBlade, edge_values(base, tip));
    const Status moved = session->move_blade(base, tip);
    note_end_of_stroke();
    check(moved);
  };
  const bool own_is_open = stroke != 0 && is_open(stroke);
  if (turn.blade && turn.cuts && !own_is_open) {
    if (is_open(stroke_)) throw Failure(bad_input("a stroke is open; end it before the batch's blade cuts"));
    note(Kind::kBeginStroke, begin_values(SceneFrame::kWorld, false));
    check(session->begin_stroke(SceneFrame::kWorld, false));
    stroke_record_ = session->strokes().size();
    stroke = ++stroke_;
    move(0);
  } else if (own_is_open && !(turn.blade && turn.cuts)) {
    note(Kind::kEndStroke);
    const Status ended = session->end_stroke();
    note_end_of_stroke();
    stroke = 0;
    check(ended);
  }
  const bool cuts = turn.blade && turn.cuts;
  if (cuts && turn.steps == 0) move(1);
  for (std::int64_t i = 1; i <= turn.steps && !turn.ended(); ++i) {
    if (cuts) move(static_cast<double>(i) / static_cast<double>(turn.steps));
    session.take_step(value_of(step_once()));
  }
}

}  // namespace kerf::python
