#include "held_recording.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <optional>

#include "errors.h"
#include "kerf/mesh/whole_file.h"
#include "python_lock.h"

namespace nb = nanobind;

namespace kerf::python {

HeldRecording HeldRecording::load(const std::string& file) {
  std::optional<Recording> read;
  std::optional<Error> error;
  {
    const WithoutPythonLock release;
    auto recording = read_recording(file);
    if (!recording) error = recording.error();
    else read = std::move(*recording);
  }
  if (error) throw Failure(*error);
  return {std::move(*read), file};
}

HeldRecording HeldRecording::of_text(const std::string& text, std::string file) {
  std::optional<Recording> read;
  std::optional<Error> error;
  {
    const WithoutPythonLock release;
    auto recording = parse_recording(text, file.empty() ? "a pickled recording" : file);
    if (!recording) error = recording.error();
    else read = std::move(*recording);
  }
  if (error) throw Failure(*error);
  return {std::move(*read), std::move(file)};
}

std::string HeldRecording::text() const {
  const WithoutPythonLock release;
  return recording_text(*recording_);
}

void HeldRecording::save(const std::string& file) const {
  Status saved;
  {
    const WithoutPythonLock release;
    saved = replace_file(file, recording_text(*recording_));
  }
  check(saved);
}

Error HeldRecording::named(Error error) const {
  if (!file_.empty() && error.message.find(file_) == std::string::npos) error.message = file_ + ": " + error.message;
  return error;
}

std::pair<std::string, double> HeldRecording::title_and_step(const std::vector<std::string>& meshes) const {
  std::pair<std::string, double> out;
  std::optional<Error> error;
  {
    const WithoutPythonLock release;
    const auto scene = scene_of(*recording_, {meshes.begin(), meshes.end()}, file_);
    if (!scene) error = scene.error();
    else out = {scene->title, scene->simulation.time_step};
  }
  if (error) throw Failure(named(*error));
  return out;
}

nb::list HeldRecording::changes() const {
  nb::list out;
  for (const SessionChange& change : recording_->changes) {
    nb::dict item;
    item["step"] = change.step;
    item["kind"] = std::string(change_word(change.kind));
    if (!change.id.empty()) item["id"] = change.id;
    if (!change.vertices.empty()) item["elements"] = change.vertices;
    item["values"] = change.values;
    out.append(item);
  }
  return out;
}

nb::dict HeldRecording::compare(const HeldRecording& other) const {
  RecordingDifference d;
  {
    const WithoutPythonLock release;
    d = kerf::compare(*recording_, *other.recording_);
  }
  const auto step_or_none = [](std::int64_t step) { return step < 0 ? nb::none() : nb::cast(step); };
  nb::dict out;
  out["same"] = d.none();
  out["settings"] = d.settings;
  out["first_change"] = step_or_none(d.first_change);
  out["changes"] = nb::make_tuple(d.change_a, d.change_b);
  out["first_difference"] = step_or_none(d.first_hash);
  out["hashes"] = d.common_hashes;
  out["same_end"] = d.same_end;
  return out;
}

void Play::to(LiveSession& session, std::int64_t step) {
  std::optional<Error> error;
  try {
    session.play(replay_, begun_, step, [this] {
      report_ = replay_.report();
      over_ = replay_.over();
    });
  } catch (const Failure& failure) {
    error = failure.error();
  }
  if (error) throw Failure(held_.named(*error));
}

nb::dict Play::report() const {
  const ReplayReport& r = report_;
  nb::dict out;
  out["same"] = r.first_difference < 0;
  out["first_difference"] = r.first_difference < 0 ? nb::none() : nb::cast(r.first_difference);
  out["steps"] = r.steps;
  out["over"] = over_;
  out["hashes"] = r.hashes;
  out["refused"] = r.refused == 0 ? nb::none() : nb::cast(r.first_refused);
  out["score"] = score_or_none(r.score);
  return out;
}

}  // namespace kerf::python
