#include "live_session.h"

#include <nanobind/stl/string.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <functional>
#include <utility>
#include <vector>

#include "errors.h"
#include "held_recording.h"
#include "interrupts.h"
#include "kerf/base/stopwatch.h"
#include "kerf/mesh/whole_file.h"
#include "kerf/record/run_report.h"
#include "kerf/record/saved_session.h"
#include "kerf/scene/scene_file.h"
#include "live_session_use.h"
#include "memory_body.h"
#include "python_lock.h"

namespace nb = nanobind;

namespace kerf::python {
namespace {

using Kind = SessionChange::Kind;

std::uint64_t next_number() {
  static std::atomic<std::uint64_t> last = 0;
  return ++last;
}

SessionChange change_of(Kind kind, std::vector<double> values) {
  SessionChange change;
  change.kind = kind;
  change.values = std::move(values);
  return change;
}

}  // namespace

std::string snapshot_bytes(const Snapshot& snapshot) {
  return value_of(unlocked([&]() -> Result<std::string> {
    if (!snapshot.state) return saved_state_bytes(snapshot.bytes, {});
    const auto state = Session::state_bytes(*snapshot.state);
    if (!state) return state.error();
    return saved_state_bytes(*state, {});
  }));
}

Snapshot snapshot_of_bytes(std::string_view bytes) {
  auto saved = value_of(unlocked([&] { return parse_saved_session(bytes, "a pickled snapshot"); }));
  return {nullptr, std::move(saved.state), 0, false, nullptr};
}

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

LiveSession::LiveSession(const std::string& text, const std::string& name, const std::string& folder,
                         const std::vector<std::string>& meshes, const nb::dict& bodies, bool record, bool scripted)
    : number_(next_number()) {
  SceneSource& source = begin_.source;
  source.text = text;
  source.name = std::filesystem::path(name).stem().string();
  source.folder = folder.empty() ? std::filesystem::current_path() : std::filesystem::absolute(folder);
  source.mesh_folders.assign(meshes.begin(), meshes.end());
  begin_.overrides.scripted = scripted;
  SceneFolders folders{std::filesystem::path(folder)};
  folders.meshes.assign(meshes.begin(), meshes.end());
  for (const auto [word, body] : bodies)
    folders.bodies[nb::cast<std::string>(word)] = nb::cast<const MemoryBody&>(body).loaded();
  make([&](const Progress& progress) -> Status {
    auto scene = parse_scene(text, name, folders);
    if (!scene) return scene.error();
    if (!scripted) scene->commands.clear();
    auto session = Session::create(*scene, progress);
    if (!session) return session.error();
    if (record) {
      auto recorder = Recorder::begin(source, *session, scripted);
      if (!recorder) return recorder.error();
      recorder_ = std::move(*recorder);
    }
    session_ = std::move(*session);
    return {};
  });
}

LiveSession::LiveSession(const HeldRecording& recording, const std::vector<std::string>& meshes)
    : number_(next_number()) {
  take_begin(*recording.recording());
  make([&](const Progress& progress) -> Status {
    auto session = session_of(*recording.recording(), progress, {meshes.begin(), meshes.end()}, recording.file());
    if (!session) return recording.named(session.error());
    session_ = std::move(*session);
    return {};
  });
}

LiveSession::LiveSession(const char* bytes, std::size_t size, const std::string& file,
                         const std::vector<std::string>& meshes)
    : number_(next_number()) {
  make([&](const Progress& progress) -> Status {
    auto saved = bytes != nullptr ? parse_saved_session({bytes, size}, file) : read_saved_session(file);
    if (!saved) return saved.error();
    take_begin(saved->scene);
    auto session = go_on(*saved, progress, {meshes.begin(), meshes.end()}, file);
    if (!session) return session.error();
    session_ = std::move(*session);
    return {};
  });
}

void LiveSession::take_begin(const Recording& recording) {
  begin_.source = recording.source;
  begin_.overrides = recording.overrides;
  meshes_travel_ = true;
}

void LiveSession::make(const std::function<Status(const Progress&)>& work) {
  Interrupts interrupts;
  Status done;
  {
    const WithoutPythonLock release;
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
    const WithoutPythonLock release;
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
    const WithoutPythonLock release;
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
  if (is_open(stroke_) && !hand_has_cut() && session->undo_depth() == 0)
    throw Failure(bad_input("there is no stroke to undo; the one that is open has cut nothing"));
  ++changes_;
  note(Kind::kUndo);
  const Status done = unlocked([&] { return session->undo(); });
  note_end_of_stroke();
  check(done);
}

void LiveSession::redo() {
  Use session(*this);
  if (is_open(stroke_))  // nothing was undone since it began
    throw Failure(bad_input("there is no stroke to redo; one is open, which goes on"));
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

// --- Going on elsewhere, and going back ---

std::string LiveSession::saved_bytes() {
  Use session(*this);
  return value_of(unlocked([&]() -> Result<std::string> {
    if (meshes_travel_) return saved_session_bytes(*session, begin_);
    Recording begin = begin_;
    begin.overrides.dust = session->scene().cut.dust;
    KERF_TRY(take_meshes(session->scene(), begin.source));
    return saved_session_bytes(*session, begin);
  }));
}

void LiveSession::save(const std::string& file) {
  const std::string bytes = saved_bytes();
  Use session(*this);
  for (const SceneFileUse& use : session->scene().files)
    if (same_file(use.path, file))
      throw Failure(bad_input(file + ": this is a file that the scene reads; save to another one"));
  check(unlocked([&] { return replace_file(file, bytes); }));
}

Snapshot LiveSession::snapshot() {
  Use session(*this);
  const auto notes = recorder_ ? std::make_shared<const Recorder::Notes>(recorder_->notes()) : nullptr;
  return {unlocked([&] { return session->snapshot(); }), {}, number_, is_open(stroke_), notes};
}

void LiveSession::restore(const Snapshot& snapshot) {
  Use session(*this);
  if (snapshot.state && snapshot.session != number_)
    throw Failure(bad_input(
        "this snapshot was taken of another session; pickled and unpickled it is for all sessions of the same scene"));
  ++changes_;
  if (!snapshot.state) {
    check(unlocked([&] { return session->take_state(snapshot.bytes); }));
    ++restores_;
    stroke_record_ = 0;
    if (recorder_) recorder_->give_up("a snapshot that came from elsewhere was restored");
    return;
  }
  ++restores_;
  unlocked([&] { session->restore(snapshot.state); });
  if (recorder_) recorder_->go_back(*snapshot.notes);
  stroke_record_ = 0;
  // A hand's stroke that was open then is nobody's now. A blade of the scene goes on from where it was.
  if (!snapshot.in_hand) return;
  note(Kind::kEndStroke);
  check(session->end_stroke());
}

std::uint64_t LiveSession::restores() {
  const Use session(*this);
  return restores_;
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
std::string LiveSession::name() {
  const Use session(*this);
  return begin_.source.name;
}
std::string LiveSession::title() { return Use(*this)->scene().title; }
std::vector<std::string> LiveSession::notes() { return Use(*this)->notes(); }

BodyCounts LiveSession::body_counts() { return Use(*this)->counts(); }

nb::dict LiveSession::counts() {
  const BodyCounts counts = unlocked([&] { return body_counts(); });
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
  const SessionChange change = change_of(Kind::kMaterial, {young, poisson, density});
  check(unlocked([&] { return kerf::apply(*session, change); }));
  note(change.kind, change.values);
}
Vec3 LiveSession::gravity() { return Use(*this)->gravity(); }
void LiveSession::set_gravity(Vec3 gravity) {
  Use session(*this);
  ++changes_;
  const SessionChange change = change_of(Kind::kGravity, {gravity.x, gravity.y, gravity.z});
  check(kerf::apply(*session, change));
  note(change.kind, change.values);
}
nb::object LiveSession::score() {
  Use session(*this);
  return score_or_none(unlocked([&] { return session->score(); }));
}
double LiveSession::roughness() {
  Use session(*this);
  return unlocked([&] { return session->roughness(); });
}
PieceMasses LiveSession::sorted_masses() {
  PieceMasses masses = Use(*this)->piece_masses();
  std::sort(masses.mass.begin(), masses.mass.end(), std::greater<>());
  return masses;
}
std::pair<nb::object, double> LiveSession::piece_masses() {
  PieceMasses masses = unlocked([&] { return sorted_masses(); });
  const std::size_t count = masses.mass.size();
  return {read_only_array<double>(std::move(masses.mass), {count}), masses.uncut};
}

}  // namespace kerf::python
