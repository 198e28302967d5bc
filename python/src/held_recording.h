// A recording as Python sees it, and its way through a session.
#pragma once

#include <nanobind/nanobind.h>

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "kerf/record/recording.h"
#include "live_session.h"

namespace kerf::python {

/// It never changes.
class HeldRecording {
 public:
  /// `file`: where it comes from, for messages; empty: a session of this process.
  HeldRecording(Recording recording, std::string file)
      : recording_(std::make_shared<const Recording>(std::move(recording))), file_(std::move(file)) {}
  static HeldRecording load(const std::string& file);
  /// One whose text() this is; `file` is where it was loaded from, or empty.
  static HeldRecording of_text(const std::string& text, std::string file);
  void save(const std::string& file) const;
  /// What save() writes.
  [[nodiscard]] std::string text() const;

  [[nodiscard]] const std::shared_ptr<const Recording>& recording() const { return recording_; }
  [[nodiscard]] const std::string& file() const { return file_; }
  /// Title, and length of a step (s), of its scene; mesh files are looked for in these folders too.
  [[nodiscard]] std::pair<std::string, double> title_and_step(const std::vector<std::string>& meshes) const;
  [[nodiscard]] nanobind::list changes() const;
  [[nodiscard]] nanobind::dict compare(const HeldRecording& other) const;
  /// With the file's name in its message.
  [[nodiscard]] Error named(Error error) const;

 private:
  std::shared_ptr<const Recording> recording_;
  std::string file_;
};

class Play {
 public:
  explicit Play(const HeldRecording& recording) : held_(recording), replay_(*held_.recording()) {}
  /// Goes on until so many steps are done, or it is over.
  void to(LiveSession& session, std::int64_t step);
  [[nodiscard]] std::int64_t steps() const { return report_.steps; }
  [[nodiscard]] bool over() const { return over_; }
  [[nodiscard]] nanobind::dict report() const;

 private:
  HeldRecording held_;
  Replay replay_;
  bool begun_ = false;
  ReplayReport report_;  ///< as of the last stop: another thread may be playing
  bool over_ = false;
};

}  // namespace kerf::python
