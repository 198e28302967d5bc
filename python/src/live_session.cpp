#include "live_session.h"

#include <nanobind/stl/string.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <functional>
#include <span>
#include <type_traits>
#include <utility>
#include <variant>

#include "errors.h"
#include "held_recording.h"
#include "interrupts.h"
#include "kerf/base/stopwatch.h"
#include "kerf/engine/led_session.h"
#include "kerf/record/run_report.h"
#include "kerf/scene/scene_file.h"
#include "kerf/session/material_places.h"
#include "memory_body.h"
#include "state_records.h"

namespace nb = nanobind;

namespace kerf::python {
namespace {

using Kind = SessionChange::Kind;

std::uint64_t next_number() {
  static std::atomic<std::uint64_t> last = 0;
  return ++last;
}

/// Does something long without Python's lock.
template <class Work>
auto unlocked(Work&& work) {
  const nb::gil_scoped_release release;
  return work();
}

template <class Scalar, std::size_t kColumns, class Item>
nb::object rows_of(std::vector<Item> items) {
  static_assert(sizeof(Item) == kColumns * sizeof(Scalar));
  const std::size_t rows = items.size();
  return read_only_array<Scalar>(std::move(items), {rows, kColumns});
}
template <class VertexId>
nb::object triangles_of(std::vector<VertexId> corners) {
  static_assert(sizeof(VertexId) == sizeof(std::int32_t));
  const std::size_t rows = corners.size() / 3;
  return read_only_array<std::int32_t>(std::move(corners), {rows, 3});
}

/// Records as bytes, one row each.
template <class Record>
nb::object bytes_of(std::vector<Record> records) {
  const std::size_t count = records.size();
  return read_only_array<std::uint8_t>(std::move(records), {count, sizeof(Record)});
}

std::vector<Vec3> places_in(const double* numbers, std::size_t count) {
  std::vector<Vec3> out(count);
  for (std::size_t i = 0; i < count; ++i) out[i] = {numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]};
  return out;
}
void store(Vec3 p, double* to) {
  for (int i = 0; i < 3; ++i) to[i] = p[i];
}

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

nb::object score_or_none(const std::optional<TrainerScore>& score) {
  if (!score) return nb::none();
  nb::dict out;
  out["lesion_volume"] = score->lesion_volume;
  out["lesion_removed"] = score->lesion_removed;
  out["healthy_removed"] = score->healthy_removed;
  out["healthy_share"] = score->healthy_share;
  out["loose_pieces"] = score->loose_pieces;
  out["roughness"] = score->roughness;
  out["largest_force"] = score->largest_force;
  return out;
}

/// A session in use by this thread. Errors: it is closed, or another thread is in it.
class LiveSession::Use {
 public:
  explicit Use(LiveSession& live) : live_(live) {
    if (live.busy_.exchange(true))
      throw Failure(
          failed("this session is in use by another thread; give each thread a session of its own, or a lock"));
    if (live.session_) {
      if (const auto view = live.view()) enter(view->led());
      return;
    }
    live.busy_ = false;
    throw Failure(bad_input("this session is closed"));
  }
  ~Use() {
    live_.stop_watching_where_due();
    if (led_) led_->leave(live_.changes_);
    live_.busy_ = false;
  }
  Use(const Use&) = delete;
  Use& operator=(const Use&) = delete;
  Session& operator*() { return *live_.session_; }
  Session* operator->() { return &*live_.session_; }

  /// From now on it is shared with who looks at it.
  void enter(std::shared_ptr<LedSession> led) {
    led->enter();
    led_ = std::move(led);
  }
  /// Something has changed, and more is to come: whoever waits looks first.
  void let_look() {
    ++live_.changes_;
    if (led_) led_->let_look(live_.changes_);
  }
  void take_step(SessionStep step) {
    live_.last_step_ = std::move(step);
    if (led_) led_->stepped(live_.last_step_);
    let_look();
  }

 private:
  LiveSession& live_;
  std::shared_ptr<LedSession> led_;
};

LiveSession::LiveSession(const std::string& text, const std::string& name, const std::string& folder,
                         const std::vector<std::string>& meshes, const nb::dict& bodies, bool record)
    : number_(next_number()) {
  if (record && bodies.size() > 0)
    throw Failure(bad_input(
        "a kerf.Body is in no file, and recordings hold files; save() the body and name its file in the scene"));
  source_.text = text;
  source_.name = std::filesystem::path(name).stem().string();
  source_.folder = folder.empty() ? std::filesystem::current_path() : std::filesystem::absolute(folder);
  source_.mesh_folders.assign(meshes.begin(), meshes.end());
  SceneFolders folders{std::filesystem::path(folder)};
  folders.meshes.assign(meshes.begin(), meshes.end());
  for (const auto [word, body] : bodies)
    folders.bodies[nb::cast<std::string>(word)] = nb::cast<const MemoryBody&>(body).loaded();
  make([&](const Progress& progress) -> Status {
    const auto scene = parse_scene(text, name, folders);
    if (!scene) return scene.error();
    auto session = Session::create(*scene, progress);
    if (!session) return session.error();
    if (record) {
      auto recorder = Recorder::begin(source_, *session);
      if (!recorder) return recorder.error();
      recorder_ = std::move(*recorder);
    }
    session_ = std::move(*session);
    return {};
  });
}

LiveSession::LiveSession(const HeldRecording& recording, const std::vector<std::string>& meshes)
    : number_(next_number()) {
  source_ = recording.recording()->source;
  make([&](const Progress& progress) -> Status {
    auto session = session_of(*recording.recording(), progress, {meshes.begin(), meshes.end()}, recording.file());
    if (!session) return recording.named(session.error());
    session_ = std::move(*session);
    return {};
  });
}

void LiveSession::make(const std::function<Status(const Progress&)>& work) {
  Interrupts interrupts;
  Status done;
  {
    const nb::gil_scoped_release release;
    Stopwatch watch;
    done = work(interrupts.listener());
    prepare_seconds_ = watch.lap();
  }
  interrupts.raise();
  check(done);
  at_start_ = session_->counts();
}

Result<SessionStep> LiveSession::step_once() {
  auto step = session_->step();
  if (recorder_) recorder_->stepped(*session_, step.ok());
  return step;
}

void LiveSession::step(std::int64_t n) {
  if (n < 0) throw nb::value_error("n must not be negative");
  Use session(*this);
  ++changes_;
  Interrupts interrupts;
  std::optional<Error> error;
  {
    const nb::gil_scoped_release release;
    for (std::int64_t i = 0; i < n && !interrupts.wanted(); ++i) {
      auto step = step_once();
      if (!step) {
        error = step.error();
        break;
      }
      session.take_step(std::move(*step));
    }
  }
  interrupts.raise();
  if (error) throw Failure(*error);
}

void LiveSession::play(Replay& replay, bool& begun, std::int64_t until, const std::function<void()>& played) {
  Use session(*this);
  ++changes_;
  Interrupts interrupts;
  Status done;
  {
    const nb::gil_scoped_release release;
    if (!begun) replay.begin(*session);
    begun = true;
    while (done.ok() && replay.report().steps < until && !replay.over() && !interrupts.wanted()) {
      auto step = replay.step(*session);
      if (step) session.take_step(std::move(*step));
      else done = step.error();
    }
  }
  note_end_of_stroke();
  played();
  interrupts.raise();
  check(done);
}

HeldRecording LiveSession::recording() {
  Use session(*this);
  if (!recorder_)
    throw Failure(bad_input("nothing of this session was noted; make it with kerf.Session(scene, record=True)"));
  return {value_of(unlocked([&] { return recorder_->recording(*session); })), ""};
}

void LiveSession::undo() {
  Use session(*this);
  ++changes_;
  note(Kind::kUndo);
  const Status done = unlocked([&] { return session->undo(); });
  note_end_of_stroke();
  check(done);
}

void LiveSession::redo() {
  Use session(*this);
  ++changes_;
  note(Kind::kRedo);
  const Status done = unlocked([&] { return session->redo(); });
  note_end_of_stroke();
  check(done);
}

void LiveSession::validate() {
  Use session(*this);
  check(unlocked([&] { return session->validate(); }));
}

void LiveSession::close() {
  if (!session_) return;
  Use session(*this);
  if (const auto watched = view()) {
    unlocked([&] { watched->close(); });
    forget_view(watched);
  }
  // Closed at once for who asks meanwhile; what a large body holds takes a while to free.
  std::optional<Session> dying = std::exchange(session_, std::nullopt);
  for (KeptArray* array : {&positions_, &velocities_, &normals_, &rest_positions_, &triangles_, &walls_, &uvs_,
                           &collision_positions_, &collision_rest_, &collision_triangles_, &nodes_, &node_velocities_,
                           &hexahedra_, &contacts_, &tools_, &grasps_})
    array->forget();
  unlocked([&] {
    painter_.reset();
    recorder_.reset();
    dying.reset();
  });
}

LiveSession::~LiveSession() {
  if (view_) view_->close();
}

// --- The page ---

std::shared_ptr<SessionView> LiveSession::view() {
  const std::scoped_lock lock(view_mutex_);
  return view_;
}

void LiveSession::forget_view(const std::shared_ptr<SessionView>& view) {
  const std::scoped_lock lock(view_mutex_);
  if (view_ != view) return;
  view_.reset();
  watched_in_vain_ = true;
}

void LiveSession::stop_watching_where_due() {
  if (watched_in_vain_.exchange(false) && session_) session_->watch_changes(false);
}

void LiveSession::open_view(const ViewRequest& request) {
  if (view()) close_view();
  Use session(*this);
  stop_watching_where_due();
  auto made = value_of(unlocked([&] { return SessionView::create(*session, source_, request); }));
  session.enter(made->led());
  if (const Status started = made->start(); !started) {
    watched_in_vain_ = true;
    throw Failure(started.error());
  }
  const std::scoped_lock lock(view_mutex_);
  view_ = std::move(made);
}

void LiveSession::close_view() {
  const auto watched = view();
  if (!watched) return;
  unlocked([&] { watched->close(); });
  forget_view(watched);
  if (busy_.exchange(true)) return;  // whoever is in it stops the watching
  stop_watching_where_due();
  busy_ = false;
}

std::string LiveSession::view_address() {
  const auto watched = view();
  return watched ? watched->address() : std::string();
}

int LiveSession::view_port() {
  const auto watched = view();
  return watched ? watched->port() : 0;
}

void LiveSession::expect_page(const std::string& ticket) {
  if (const auto watched = view()) watched->expect(ticket);
}

void LiveSession::abandon_view() {
  if (!view_) return;
  view_->abandon();
  // Its thread is the parent's: what it holds is never given back here.
  new std::shared_ptr<SessionView>(std::move(view_));
  view_.reset();
  busy_ = false;
}

// --- Strokes ---

bool LiveSession::is_open(std::uint64_t stroke) const {
  return stroke == stroke_ && session_->in_stroke() && session_->strokes().size() == stroke_record_;
}

void LiveSession::must_be_open(std::uint64_t stroke) const {
  if (!is_open(stroke)) throw Failure(bad_input("this stroke is over; begin another one"));
}

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
    const nb::gil_scoped_release release;
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

void LiveSession::places_now(const double* rest, std::size_t count, double* now) {
  Use session(*this);
  const std::vector<Vec3> from = places_in(rest, count), to = kerf::places_now(*session, from);
  for (std::size_t i = 0; i < count; ++i) store(to[i], now + 3 * i);
}

void LiveSession::places_at_rest(const double* now, std::size_t count, double* rest, double* distance) {
  Use session(*this);
  const std::vector<MiddlePlace> to = kerf::places_at_rest(*session, places_in(now, count));
  for (std::size_t i = 0; i < count; ++i) {
    store(to[i].rest, rest + 3 * i);
    distance[i] = to[i].distance;
  }
}

// --- Snapshots ---

Snapshot LiveSession::snapshot() {
  Use session(*this);
  const auto notes = recorder_ ? std::make_shared<const Recorder::Notes>(recorder_->notes()) : nullptr;
  return {unlocked([&] { return session->snapshot(); }), number_, is_open(stroke_), notes};
}

void LiveSession::restore(const Snapshot& snapshot) {
  Use session(*this);
  if (snapshot.session != number_) throw Failure(bad_input("this snapshot was taken of another session"));
  ++changes_;
  unlocked([&] { session->restore(snapshot.state); });
  if (recorder_) recorder_->go_back(*snapshot.notes);
  stroke_record_ = 0;
  // A hand's stroke that was open then is nobody's now. A blade of the scene goes on from where it was.
  if (!snapshot.in_hand) return;
  note(Kind::kEndStroke);
  check(session->end_stroke());
}

// --- State ---

double LiveSession::time() { return Use(*this)->time(); }
double LiveSession::time_step() { return Use(*this)->time_step(); }
std::int64_t LiveSession::steps() { return Use(*this)->step_count(); }
std::uint64_t LiveSession::hash() {
  Use session(*this);
  return unlocked([&] { return session->hash(); });
}
std::uint64_t LiveSession::topology_version() { return Use(*this)->topology_version(); }
int LiveSession::undo_depth() { return Use(*this)->undo_depth(); }
int LiveSession::redo_depth() { return Use(*this)->redo_depth(); }
bool LiveSession::in_stroke() { return Use(*this)->in_stroke(); }
std::string LiveSession::name() { return Use(*this)->scene().name; }
std::string LiveSession::title() { return Use(*this)->scene().title; }
std::vector<std::string> LiveSession::notes() { return Use(*this)->notes(); }

nb::dict LiveSession::counts() {
  Use session(*this);
  const BodyCounts counts = unlocked([&] { return session->counts(); });
  nb::dict out;
  out["visual_vertices"] = counts.visual_vertices;
  out["visual_triangles"] = counts.visual_triangles;
  out["collision_vertices"] = counts.collision_vertices;
  out["collision_triangles"] = counts.collision_triangles;
  out["nodes"] = counts.nodes;
  out["hexahedra"] = counts.hexahedra;
  out["pieces"] = counts.pieces;
  return out;
}

nb::dict LiveSession::last_step() {
  Use session(*this);
  nb::dict out;
  out["seconds"] = last_step_.seconds;
  out["parts"] = last_step_.parts;
  out["topology_changed"] = last_step_.topology_changed;
  out["iterations"] = last_step_.mechanics.iterations;
  out["residual"] = last_step_.mechanics.residual;
  return out;
}

std::string LiveSession::report_json() {
  Use session(*this);
  RunLog log;
  log.counts_before = at_start_;
  log.prepare_seconds = prepare_seconds_;
  return unlocked([&] { return run_report_json(*session, log); });
}

nb::object LiveSession::positions() {
  Use session(*this);
  return positions_.get(changes_,
                        [&] { return rows_of<double, 3>(unlocked([&] { return session->visual_positions(); })); });
}
nb::object LiveSession::velocities() {
  Use session(*this);
  return velocities_.get(changes_,
                         [&] { return rows_of<double, 3>(unlocked([&] { return session->visual_velocities(); })); });
}
nb::object LiveSession::normals() {
  Use session(*this);
  return normals_.get(changes_, [&] {
    std::vector<Vec3f> places, normals;
    unlocked([&] { session->visual_skin(places, normals); });
    return rows_of<float, 3>(std::move(normals));
  });
}
nb::object LiveSession::rest_positions() {
  Use session(*this);
  return rest_positions_.get(session->topology_version(), [&] {
    return rows_of<double, 3>(unlocked([&] { return session->body().complex.visual.rest.raw(); }));
  });
}
nb::object LiveSession::triangles() {
  Use session(*this);
  return triangles_.get(session->topology_version(), [&] {
    return triangles_of(unlocked([&] { return session->body().complex.visual.origin.raw(); }));
  });
}
nb::object LiveSession::walls() {
  Use session(*this);
  return walls_.get(session->topology_version(), [&] {
    std::vector<std::uint8_t> walls;
    for (const Patch patch : session->body().complex.visual.patch.raw()) walls.push_back(patch.is_wall() ? 1 : 0);
    const std::size_t rows = walls.size();
    return read_only_array<bool>(std::move(walls), {rows});
  });
}
nb::object LiveSession::uvs() {
  Use session(*this);
  return uvs_.get(session->topology_version(), [&] {
    std::vector<Vec2f> corners = session->body().complex.visual.texture.raw();
    const std::size_t rows = corners.size() / 3;
    return read_only_array<float>(std::move(corners), {rows, 3, 2});
  });
}
nb::object LiveSession::collision_positions() {
  Use session(*this);
  return collision_positions_.get(
      changes_, [&] { return rows_of<double, 3>(unlocked([&] { return session->collision_positions(); })); });
}
nb::object LiveSession::collision_rest_positions() {
  Use session(*this);
  return collision_rest_.get(session->topology_version(), [&] {
    return rows_of<double, 3>(unlocked([&] { return session->body().complex.collision.rest.raw(); }));
  });
}
nb::object LiveSession::collision_triangles() {
  Use session(*this);
  return collision_triangles_.get(session->topology_version(), [&] {
    return triangles_of(unlocked([&] { return session->body().complex.collision.origin.raw(); }));
  });
}
nb::object LiveSession::nodes() {
  Use session(*this);
  return nodes_.get(changes_, [&] { return rows_of<double, 3>(unlocked([&] { return session->node_positions(); })); });
}
nb::object LiveSession::node_velocities() {
  Use session(*this);
  return node_velocities_.get(changes_,
                              [&] { return rows_of<double, 3>(unlocked([&] { return session->node_velocities(); })); });
}
nb::object LiveSession::hexahedra() {
  Use session(*this);
  return hexahedra_.get(session->topology_version(), [&] {
    const HexMesh& mesh = session->body().hex;
    std::vector<std::array<NodeId, 8>> alive;
    for (const HexId h : ids<HexId>(mesh.hex_count()))
      if (mesh.alive(h)) alive.push_back(mesh.nodes[h]);
    return rows_of<std::int32_t, 8>(std::move(alive));
  });
}

nb::object LiveSession::contacts() {
  Use session(*this);
  return contacts_.get(changes_, [&] {
    std::vector<ContactRecord> records;
    for (const Session::ContactState& c : session->contacts()) records.push_back(record_of(c));
    return bytes_of(std::move(records));
  });
}
nb::object LiveSession::tools() {
  Use session(*this);
  return tools_.get(changes_, [&] {
    std::vector<ToolRecord> records;
    for (const Session::ToolState& t : session->tools()) records.push_back(record_of(t));
    return bytes_of(std::move(records));
  });
}
nb::object LiveSession::grasps() {
  Use session(*this);
  return grasps_.get(changes_, [&] {
    std::vector<GraspRecord> records;
    for (const Session::GraspState& g : session->grasps())
      records.push_back({g.held, g.target, session->grasp_force(g.id), static_cast<std::int64_t>(g.points.size())});
    return bytes_of(std::move(records));
  });
}
std::vector<std::string> LiveSession::tool_ids() {
  Use session(*this);
  std::vector<std::string> out;
  for (const SceneRigidTool& tool : session->scene().tools) out.push_back(tool.id);
  return out;
}
std::vector<std::string> LiveSession::grasp_ids() {
  Use session(*this);
  std::vector<std::string> out;
  for (const Session::GraspState& g : session->grasps()) out.push_back(g.id);
  return out;
}
Vec3 LiveSession::support_force() { return Use(*this)->support_force(); }

// --- Pictures ---

Status LiveSession::make_painter() {
  if (painter_) return {};
  auto painter = SessionPainter::create(*session_);
  if (!painter) return painter.error();
  painter_ = std::move(*painter);
  return {};
}

PictureView LiveSession::fitted_view(int width, int height) {
  Use session(*this);
  PictureView view;
  check(unlocked([&]() -> Status {
    KERF_TRY(make_painter());
    view = painter_->fitted_view(*session, session->scene().output.camera, width, height);
    return {};
  }));
  return view;
}

nb::object LiveSession::render(int width, int height, std::optional<PictureView> view, bool depth, bool shadows) {
  Use session(*this);
  const auto rows = static_cast<std::size_t>(height), columns = static_cast<std::size_t>(width);
  std::vector<std::uint8_t> rgb;
  std::vector<float> far;
  check(unlocked([&]() -> Status {
    KERF_TRY(make_painter());
    SceneOutput output;
    output.camera = session->scene().output.camera;
    output.picture_size = {width, height};
    if (!view) view = painter_->fitted_view(*session, output.camera, width, height);
    if (shadows) rgb = painter_->draw(*session, output, view).rgb;
    else rgb.resize(3 * rows * columns);
    if (depth) far.resize(rows * columns);
    if (depth || !shadows)
      painter_->draw_quickly(*session, *view,
                             {width, height, shadows ? std::span<std::uint8_t>() : std::span(rgb), far});
    return {};
  }));
  const nb::object colors = own_array(std::move(rgb), {rows, columns, 3});
  if (!depth) return colors;
  return nb::make_tuple(colors, own_array(std::move(far), {rows, columns}));
}

nb::dict LiveSession::material() {
  Use session(*this);
  const Material material = session->material();
  nb::dict out;
  out["young"] = material.young;
  out["poisson"] = material.poisson;
  out["density"] = material.density;
  return out;
}
void LiveSession::set_material(double young, double poisson, double density) {
  Use session(*this);
  ++changes_;
  check(unlocked([&] { return session->set_material(young, poisson, density); }));
  note(Kind::kMaterial, {young, poisson, density});
}
Vec3 LiveSession::gravity() { return Use(*this)->gravity(); }
void LiveSession::set_gravity(Vec3 gravity) {
  Use session(*this);
  ++changes_;
  check(session->set_gravity(gravity));
  note(Kind::kGravity, {gravity.x, gravity.y, gravity.z});
}
nb::object LiveSession::score() {
  Use session(*this);
  return score_or_none(unlocked([&] { return session->score(); }));
}
double LiveSession::roughness() {
  Use session(*this);
  return unlocked([&] { return session->roughness(); });
}
std::pair<nb::object, double> LiveSession::piece_masses() {
  Use session(*this);
  PieceMasses masses = unlocked([&] { return session->piece_masses(); });
  std::sort(masses.mass.begin(), masses.mass.end(), std::greater<>());
  const std::size_t count = masses.mass.size();
  return {read_only_array<double>(std::move(masses.mass), {count}), masses.uncut};
}

}  // namespace kerf::python
