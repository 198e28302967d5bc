#include "command_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "command_files.h"
#include "exit_status.h"
#include "kerf/base/parallel.h"
#include "kerf/base/shown_text.h"
#include "kerf/base/stopwatch.h"
#include "kerf/mesh/whole_file.h"
#include "kerf/picture/session_picture.h"
#include "kerf/record/recording.h"
#include "kerf/record/run_outputs.h"
#include "kerf/record/run_report.h"
#include "kerf/record/saved_session.h"
#include "kerf/scene/body_scene.h"
#include "kerf/scene/scene_file.h"
#include "mesh_folders.h"
#include "plot.h"
#include "png_file.h"
#include "progress_bar.h"
#include "result_folder.h"
#include "scene_search.h"
#include "score_line.h"
#include "terminal.h"

namespace kerf::app {
namespace {

std::int64_t steps_of(const Scene& scene) {
  return static_cast<std::int64_t>(std::llround(scene.simulation.duration / scene.simulation.time_step));
}

/// A run in progress: the session, what it has collected, and where it goes.
class Run {
 public:
  Run(const Scene& scene, Session session, const RunOptions& options)
      : scene_(scene), session_(std::move(session)), options_(options), animation_(scene) {
    log_.counts_before = session_.counts();
    notes_said_ = session_.notes().size();
    strokes_before_ = session_.strokes().size();
  }
  RunLog& log() { return log_; }

  Status simulate() {
    ProgressBar bar(options_.quiet);
    const Progress progress = bar.callback();
    const std::int64_t began = session_.step_count(), steps = steps_of(scene_);
    const bool frames = scene_.output.animation || scene_.output.positions;
    const double interval = 1 / scene_.output.frames_per_second;
    std::int64_t next_frame = static_cast<std::int64_t>(std::floor(session_.time() / interval)) + 1;
    std::size_t finished = strokes_before_;
    check("start");
    if (!options_.record.empty()) hashes_.push_back({0, session_.hash()});
    if (frames) KERF_TRY(add_frame());
    for (std::int64_t i = began; i < steps; ++i) {
      auto step = session_.step();
      if (!step) return step.error();
      if (!options_.record.empty() && session_.step_count() % kHashEvery == 0)
        hashes_.push_back({session_.step_count(), session_.hash()});
      log_.add(session_, *step);
      const auto& strokes = session_.strokes();
      while (finished < strokes.size() && strokes[finished].finished) check(fmt::format("stroke {}", ++finished));
      if (frames && session_.time() >= static_cast<double>(next_frame) * interval - 0.5 * scene_.simulation.time_step) {
        KERF_TRY(add_frame());
        next_frame = std::max(next_frame, static_cast<std::int64_t>(std::llround(session_.time() / interval))) + 1;
      }
      if (scene_.output.picture && !pictured_ && scene_.output.picture_at &&
          session_.time() >= *scene_.output.picture_at)
        KERF_TRY(picture());
      KERF_TRY(progress("simulating", static_cast<double>(i + 1 - began) / static_cast<double>(steps - began)));
    }
    check("end");
    return {};
  }

  /// Writes everything there is but the report, of a run that was broken off, too.
  Status write() {
    KERF_TRY(write_final_meshes(session_, scene_.output.meshes, options_.out));
    if (scene_.output.animation && animation_.frame_count() > 0) KERF_TRY(animation_.write(options_.out / "body.glb"));
    if (scene_.output.picture && !pictured_) KERF_TRY(picture());
    return write_svg(options_.out / "steps.svg", step_plot());
  }
  [[nodiscard]] ReportedWork reported(const std::vector<CommandFile>& inputs) const {
    return {session_, log_, options_.out, result_files(scene_.output), paths_of(inputs)};
  }

  /// What kerf replay repeats: the scene as it stands, and the hashes.
  Status write_recording(const std::filesystem::path& scene_file) {
    if (options_.record.empty()) return {};
    auto recording = begin(scene_file);
    if (!recording) return recording.error();
    recording->last_step = session_.step_count();
    recording->hashes = hashes_;
    recording->end_hash = session_.hash();
    return replace_file(options_.record.string(), recording_text(*recording));
  }
  /// What --from goes on from. `saved`: what the run itself has gone on from, if it has.
  Status save(const std::filesystem::path& scene_file, const SavedSession* saved) {
    if (options_.save.empty()) return {};
    auto scene = saved != nullptr ? Result<Recording>(saved->scene) : begin(scene_file);
    if (!scene) return scene.error();
    auto bytes = saved_session_bytes(session_, *scene);
    if (!bytes) return failed(fmt::format("{}: not saved: {}", shown(options_.save.string()), bytes.error().message));
    return replace_file(options_.save.string(), *bytes);
  }

  void summary() const {
    say_notes(std::span(session_.notes()).subspan(notes_said_));
    if (const std::string note = overlap_note(session_, log_); !note.empty()) warn("note: {}\n", note);
    if (options_.quiet) return;
    const BodyCounts now = session_.counts();
    std::vector<double> milliseconds;
    for (const RunLog::Step& s : log_.steps) milliseconds.push_back(1e3 * s.seconds);
    const Quantiles q = quantiles(milliseconds);
    say("{}: {} steps of {} ms, median {:.3f} ms, 99th percentile {:.3f} ms\n", scene_.name, log_.steps.size(),
        1e3 * scene_.simulation.time_step, q.median, q.p99);
    for (std::size_t i = strokes_before_; i < session_.strokes().size(); ++i) {
      const StrokeRecord& s = session_.strokes()[i];
      say("  cut {}: {} in {:.2f} ms{}\n", i + 1, counted(s.triangles, "collision triangle"), 1e3 * s.times.total,
          s.refused > 0 ? fmt::format(", {} refused", counted(s.refused, "step")) : "");
    }
    say("  {}; visual {}/{}, collision {}/{} vertices/triangles, {} nodes, {} hexahedra\n",
        counted(now.pieces, "piece"), now.visual_vertices, now.visual_triangles, now.collision_vertices,
        now.collision_triangles, now.nodes, now.hexahedra);
    say_forces();
    if (const auto score = session_.score()) say("  {}\n", score_line(*score));
    say("  results: {}\n", options_.out.string());
  }
  /// Whether the invariants held at every check. What is broken is an error, said however quiet the run is.
  [[nodiscard]] Status invariants() const {
    std::string broken;
    for (const RunLog::Check& c : log_.checks)
      if (!c.problem.empty())
        broken += fmt::format("{}{}: invariant broken ({}, {} s): {}",
                              broken.empty() ? "" : "\nkerf: ", shown(scene_.name), c.what, c.time, c.problem);
    if (broken.empty()) return {};
    return failed(broken);
  }

 private:
  /// A recording in which nothing is done yet.
  Result<Recording> begin(const std::filesystem::path& scene_file) {
    auto text = scene_text_in(scene_file);
    if (!text) return text.error();
    Recording recording;
    recording.source.text = std::move(*text);
    recording.source.name = scene_file.stem().string();
    recording.source.folder = std::filesystem::absolute(scene_file).parent_path();
    KERF_TRY(take_meshes(scene_, recording.source));
    recording.overrides.dust = scene_.cut.dust;
    recording.instructions = instruction_set();
    return recording;
  }
  void check(const std::string& what) {
    const Status valid = session_.validate();
    log_.checks.push_back({session_.time(), what, valid ? "" : valid.error().message});
  }
  /// What tools felt, and how well contact held.
  void say_forces() const {
    const auto micrometres = [](double m) { return std::round(1e6 * m) / 1e6 + 0.0; };  // and no -0
    for (std::size_t i = 0; i < log_.tools.size(); ++i) {
      const RunLog::Tool& tool = log_.tools[i];
      const Vec3 place = session_.tools()[i].place.position,
                 at{micrometres(place.x), micrometres(place.y), micrometres(place.z)};
      say("  tool \"{}\": largest force on it {:.3g} N at {:.4g} s, torque {:.3g} N m at {:.4g} s; ends at ({:.6g}, {:.6g}, {:.6g}) m\n",
          scene_.tools[i].id, tool.force, tool.force_at, tool.torque, tool.torque_at, at.x, at.y, at.z);
    }
    int most = 0;
    for (const RunLog::Step& s : log_.steps) most = std::max(most, s.pressing);
    if (most == 0) return;
    const DeepestOverlap deepest = deepest_overlap(session_, log_);
    say("  contact: up to {} places press; deepest overlap {:.2g} mm, {:.2g} of the largest half thickness, at {:.4g} s\n",
        most, 1e3 * deepest.metres, deepest.share, deepest.time);
  }
  /// What can't be kept of a state is a run that failed, not bad input.
  Status add_frame() {
    Status added;
    if (scene_.output.animation) added = animation_.add_frame(session_);
    if (added && scene_.output.positions) {
      if (!series_) series_.emplace((options_.out / "positions.pvd").string());
      added = series_->add(session_.time(), hexahedra_vtu(session_));
    }
    return added ? added : failed(added.error().message);
  }
  /// Time of every step; the steps that cut stand out.
  [[nodiscard]] Plot step_plot() const {
    Plot plot;
    plot.title = scene_.title.empty() ? scene_.name : scene_.title;
    plot.x_label = "simulated time (s)";
    plot.y_label = "time of a step (ms)";
    plot.log_y = true;
    PlotLine whole{"whole step", {}, false, ""}, mechanics{"mechanics", {}, false, ""};
    for (const RunLog::Step& s : log_.steps) {
      whole.points.push_back({s.time, 1e3 * s.seconds});
      mechanics.points.push_back({s.time, 1e3 * s.mechanics});
    }
    plot.lines = {whole, mechanics};
    return plot;
  }
  Status picture() {
    pictured_ = true;
    auto painter = SessionPainter::create(session_);
    if (!painter.ok()) return painter.error();
    return write_png(options_.out / "picture.png", painter->draw(session_, scene_.output));
  }

  const Scene& scene_;
  Session session_;
  const RunOptions& options_;
  RunLog log_;
  std::size_t notes_said_ = 0;      ///< before the run
  std::size_t strokes_before_ = 0;  ///< of the state that it goes on from
  Animation animation_;
  std::optional<VtuSeries> series_;
  bool pictured_ = false;
  std::vector<StateHash> hashes_;
};

/// Of a scene file, or of a bound body that hangs by its far rim.
Result<Scene> scene_in(const std::filesystem::path& path, const RunOptions& options) {
  if (!is_bound_body(path)) return read_scene(path, mesh_folders(options.meshes));
  const auto text = scene_text_in(path);
  if (!text.ok()) return text.error();
  return parse_scene(*text, path.stem().string(), path.parent_path());
}

}  // namespace

int run_scene(const RunOptions& options) {
  std::optional<SavedSession> saved;
  if (!options.from.empty()) {
    auto read = read_saved_session(options.from.string());
    if (!read) return report(read.error());
    saved.emplace(std::move(*read));
  }
  const Result<std::filesystem::path> path = saved ? options.from : find_scene(options.scene);
  if (!path.ok()) return report(path.error());
  Result<Scene> scene =
      saved ? scene_of(saved->scene, mesh_folders(options.meshes), path->string()) : scene_in(*path, options);
  if (!scene.ok()) return report(scene.error());
  if (options.duration) scene->simulation.duration = *options.duration;
  if (options.threads) scene->simulation.threads = *options.threads;
  // A run of so many steps ends in nobody's lifetime, and their number would not fit in a report.
  constexpr double kMostSteps = 1e9;
  if (!(scene->simulation.duration / scene->simulation.time_step <= kMostSteps))
    return report(bad_input(fmt::format(
        "{}: {} s in time steps of {} s are more than {} steps; choose a larger time_step or a shorter duration",
        shown(path->string()), scene->simulation.duration, scene->simulation.time_step, kMostSteps)));
  const std::vector<CommandFile> inputs =
      saved ? std::vector<CommandFile>{{"the saved state", *path}} : files_of(*path, *scene);
  std::vector<CommandFile> outputs = results_in(options.out, result_files(scene->output));
  if (!options.record.empty()) outputs.push_back({"the recording", options.record});
  if (!options.save.empty()) outputs.push_back({"the saved state", options.save});
  if (const Status apart = check_outputs(inputs, outputs); !apart) return report(apart.error());
  if (!options.record.empty())
    if (const Status known = check_ending({"the recording", options.record}, {".kerfrec", ""}); !known)
      return report(known.error());
  if (!options.save.empty())
    if (const Status known = check_ending(outputs.back(), {".kerfstate", ""}); !known) return report(known.error());
  const Result<FolderLock> folder = take_result_folder(options.out);
  if (!folder) return report(folder.error());
  if (const Status possible = check_places(outputs); !possible) return report(possible.error());

  std::optional<ThreadLimit> limit;
  std::optional<Run> run;
  const Status prepared = prepare_reported({*scene, options.out, result_files(scene->output)}, [&]() -> Status {
    if (scene->simulation.threads > 0) limit.emplace(scene->simulation.threads);
    const auto start = Clock::now();
    Result<Session> session = [&] {
      ProgressBar bar(options.quiet);
      return saved ? go_on(*saved, bar.callback(), mesh_folders(options.meshes), path->string())
                   : Session::create(*scene, bar.callback());
    }();
    if (!session.ok()) return session.error();
    if (saved && session->step_count() >= steps_of(*scene))
      return bad_input(fmt::format("{}: saved at {} s, and the run ends at {} s; give a later --duration",
                                   shown(path->string()), session->time(), scene->simulation.duration));
    say_notes(session->notes());
    run.emplace(*scene, std::move(session).value(), options);
    run->log().prepare_seconds = seconds_since(start);
    return {};
  });
  if (!prepared) return report(prepared.error());
  return work_reported(run->reported(inputs), [&] {
    Status done = run->simulate();
    Status written = run->write();
    const Status recorded = run->write_recording(*path);  // it may lie on another disk
    if (written) written = recorded;
    if (done) done = run->save(*path, saved ? &*saved : nullptr);
    run->summary();
    if (done) done = written;
    return done ? run->invariants() : done;
  });
}

}  // namespace kerf::app
