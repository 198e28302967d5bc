// A session that notes what is done to it, and what to do with such a record: play it with every check, make it smaller, keep it.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "kerf/record/recording.h"
#include "kerf/session/session.h"

namespace kerf::test {

/// Everything an undo brings back.
std::uint64_t fingerprint(const Session& session);
/// In the place of a fingerprint from before supports changed: they stay what they are, and what they hold is still.
inline constexpr std::uint64_t kNotComparable = 0;

/// A Session whose changes can be played again. Only through this type: a Session& to it notes nothing.
class RecordedSession : public Session {
 public:
  /// Bad input as of parse_scene and Session::create.
  static Result<RecordedSession> create(const std::string& scene_text, const std::string& name);

  Result<SessionStep> step();
  Status step(int n);
  Status apply(const SceneCommand& command);
  Status begin_stroke(SceneFrame frame, bool through);
  Status move_blade(Vec3 base, Vec3 tip);
  Status end_stroke() {
    return noted({0, Kind::kEndStroke, {}, {}, {}}, [&] { return Session::end_stroke(); });
  }
  Status cancel_stroke() {
    return noted({0, Kind::kCancelStroke, {}, {}, {}}, [&] { return Session::cancel_stroke(); });
  }
  Status undo() {
    return noted({0, Kind::kUndo, {}, {}, {}}, [&] { return Session::undo(); });
  }
  Status redo() {
    return noted({0, Kind::kRedo, {}, {}, {}}, [&] { return Session::redo(); });
  }
  Status set_gravity(Vec3 gravity);
  Result<PunchReport> punch(const Punch& punch, SceneFrame frame, double roughness = 0);
  Result<ShaveReport> shave(const Shaver& shaver, SceneFrame frame, double smoothing, double depth);
  Result<RemovalReport> remove_piece(CollisionTriangle triangle);
  /// What is noted after a snapshot is forgotten when it is restored.
  [[nodiscard]] std::shared_ptr<const SessionSnapshot> snapshot();
  void restore(const std::shared_ptr<const SessionSnapshot>& snapshot);

  /// Without hashes: what it must come to is every check. Removals by region are left out.
  [[nodiscard]] Recording recording() const;

 private:
  using Kind = SessionChange::Kind;
  explicit RecordedSession(Session session) : Session(std::move(session)) {}
  Status noted(SessionChange change, const std::function<Status()>& what);
  void note(SessionChange change);

  Recording recording_;
  std::int64_t tried_ = 0;  ///< steps, one that failed included
  std::vector<std::pair<std::shared_ptr<const SessionSnapshot>, std::size_t>> marks_;
};

struct Problem {
  enum class Kind { kInvariant, kFailure, kUndoFails, kRedoFails, kCancelFails, kJump } kind = Kind::kInvariant;
  std::string what;
  std::size_t change = 0;  ///< changes that had been made
  std::int64_t step = 0;   ///< steps that had been made
};
/// Plays a recording; after every change and step all invariants are checked, undo, redo and cancel must bring back what was,
/// and no cut may make anything jump.
/// Bad input is an answer, not a problem.
std::optional<Problem> problem_in(const Recording& recording);

/// A shorter recording with the same kind of problem by `find`, after at most `most` of trying.
Recording shrunk(const Recording& recording, Problem::Kind kind,
                 const std::function<std::optional<Problem>(const Recording&)>& find, std::chrono::seconds most);

/// Shrinks and writes it into KERF_FUZZ_OUT (or the present folder); a sentence about it.
std::string keep_shrunk(const Recording& recording, const std::string& name);

}  // namespace kerf::test
