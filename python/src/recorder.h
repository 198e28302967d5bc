// What is done to a session by calls, noted as a recording.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "kerf/record/recording.h"
#include "kerf/session/session.h"

namespace kerf::python {

class Recorder {
 public:
  /// What was noted up to a moment.
  struct Notes {
    std::vector<SessionChange> changes;
    std::vector<StateHash> hashes;
    std::size_t bytes = 0;  ///< of the changes
    std::string trouble;    ///< why it can't be recorded any more; empty: it can
  };

  /// Of a session that has just been made of this scene, with its commands or without. Bad input: a mesh file can't be read.
  static Result<Recorder> begin(SceneSource source, const Session& session, bool scripted);

  /// Before it is done, whatever comes of it; what does nothing where it is refused, after it.
  void note(const Session& session, SessionChange change);
  void note(const Session& session, SessionChange::Kind kind, std::vector<double> values = {}) {
    note(session, {0, kind, {}, {}, std::move(values)});
  }
  /// Before and after a command.
  void before(Session& session, const SceneCommand& command);
  void after(Session& session, const SceneCommand& command, const Status& done);
  /// After a step.
  void stepped(const Session& session, bool done);

  [[nodiscard]] const Notes& notes() const { return notes_; }
  void go_back(Notes notes) { notes_ = std::move(notes); }
  /// It can't be recorded any more.
  void give_up(const std::string& why) {
    if (notes_.trouble.empty()) notes_.trouble = why;
  }
  /// Bad input: something was done that recordings have no change for.
  [[nodiscard]] Result<Recording> recording(const Session& session) const;

 private:
  Recording frame_;  ///< without changes and hashes
  Notes notes_;
  std::string no_change_;                  ///< why recordings have none for the command; empty: they have
  bool in_stroke_ = false;                 ///< before the command
  std::optional<std::int32_t> to_remove_;  ///< a collision triangle of what a grasp holds, that the command takes away
};

}  // namespace kerf::python
