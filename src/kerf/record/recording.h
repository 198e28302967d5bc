// Recordings: a scene, every change that was made to its session, by step number, and hashes of the state. Replayed, they
// give the same bits. One JSON object (docs/recording.md); numbers in it come back to the bit.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kerf/base/progress.h"
#include "kerf/base/result.h"
#include "kerf/scene/scene.h"
#include "kerf/scene/scene_file.h"
#include "kerf/session/session.h"

namespace kerf {

/// Where a scene comes from.
struct SceneSource {
  std::string text;                                 ///< TOML
  std::string name;                                 ///< stands for the file in messages
  std::filesystem::path folder;                     ///< relative mesh files start here,
  std::vector<std::filesystem::path> mesh_folders;  ///< then here
  struct File {
    std::string name, bytes;
  };
  std::vector<File> files;  ///< mesh files that have no place of their own (uploads); by name in `folder`
  /// A mesh file that the scene names.
  struct Mesh {
    std::string written;  ///< as it is named
    std::uint64_t bytes = 0, hash = 0;
    std::optional<std::string> content;  ///< none: too large to be taken along
  };
  std::vector<Mesh> meshes;  ///< once they have been read (take_meshes)
};

/// What is changed in the scene before it is run.
struct SceneOverrides {
  bool scripted = true;                       ///< keep the scene's own commands
  double time_step = 0;                       ///< s; 0: the scene's
  std::optional<double> dust = std::nullopt;  ///< SceneCut::dust; none: the scene's
};
/// Mesh files up to this size altogether travel in a recording; of others it has the hash.
inline constexpr std::size_t kMostEmbedded = std::size_t{64} << 20;
/// Reads every file that the scene names, but those of source.files, for recordings. Bad input: one can't be read.
Status take_meshes(const Scene& scene, SceneSource& source, std::size_t most = kMostEmbedded);
/// Reads the scene and applies the overrides. Bad input as parse_scene.
Result<Scene> scene_of(const SceneSource& source, const SceneOverrides& overrides);
Result<Scene> scene_of(const SceneSource& source, const SceneOverrides& overrides, const SceneFolders& folders);

/// One change to a session, made after `step` steps.
struct SessionChange {
  enum class Kind {
    kBeginStroke,  ///< values: 1 through, 0 not; 1 rest frame, 0 (or nothing) world
    kBlade,        ///< values: base, tip
    kEndStroke,
    kCancelStroke,
    kUndo,
    kRedo,
    kGrasp,    ///< id, vertices
    kMove,     ///< id; values: to, over
    kRelease,  ///< id
    kFix,
    kUnfix,     ///< values: shape (0 box, 1 sphere, 2 half-space), then min max | centre radius | point normal
    kGravity,   ///< values: x, y, z
    kMaterial,  ///< values: young, poisson, density
    kPunch,  ///< values: 1 rest frame, 0 world (+ 2: what comes loose is taken away); reach (< 0: through everything); roughness; centre, axis, across; x, y of the outline's corners
    kShave,  ///< values: frame; base, tip, radius; smoothing, depth. Passes go on until kEndStroke
    kRemove,  ///< one collision triangle: its piece goes
    kSuck,    ///< values: a region as for kFix, in the world: loose pieces that reach into it go
    kTool,    ///< id; values: position, rotation (axis times angle), over
    kJaws,    ///< id; values: 1 close, 0 open; over
    kLift,    ///< the blade of a stroke is taken out; it goes on with the next kBlade
  };
  std::int64_t step = 0;
  Kind kind = Kind::kUndo;
  std::string id;
  std::vector<std::int32_t> vertices;
  std::vector<double> values;
};
/// As in a recording: "begin_stroke" ...
std::string_view change_word(SessionChange::Kind kind);
SessionChange region_change(SessionChange::Kind kind, const SceneRegion& region);

/// Bad input: values that a change of this kind can't have.
Status check(const SessionChange& change);
/// Is it a plain file name, that stays in the folder it is put in?
bool plain_file_name(const std::string& name);

/// Does it. Bad input: whatever the session refuses, or values that a change of this kind can't have.
Status apply(Session& session, const SessionChange& change);

struct StateHash {
  std::int64_t step = 0;
  std::uint64_t hash = 0;
};
struct Recording {
  SceneSource source;
  SceneOverrides overrides;
  std::string instructions;            ///< instruction set it was made with
  std::vector<SessionChange> changes;  ///< by step
  std::vector<StateHash> hashes;       ///< by step; each before the changes of its step
  std::int64_t last_step = 0;
  std::uint64_t end_hash = 0;  ///< after everything
};

/// The instruction set that this library was compiled for.
std::string_view instruction_set();
/// Steps between two hashes.
inline constexpr std::int64_t kHashEvery = 100;

std::string recording_text(const Recording& recording);
/// Bad input: not a recording, another version, or anything in it that can't be.
Result<Recording> parse_recording(std::string_view text, std::string_view name);
/// The recording in a file. Bad input too: a file that can't be read, or is larger than recordings are (file_limits.h).
Result<Recording> read_recording(const std::string& path);

/// What came of a replay.
struct ReplayReport {
  std::int64_t steps = 0, hashes = 0;
  std::int64_t first_difference = -1;  ///< step; -1: every hash agrees
  std::optional<TrainerScore> score;   ///< at the end; none in a scene without a lesion
  std::size_t refused = 0;             ///< changes that the session refused, as it did when it was recorded
  std::string first_refused;           ///< of those the first: its entry in the recording, and what the session said
};
/// The scene of a recording. Meshes that did not travel in it are looked for where the scene was, then in `mesh_folders`; bad input: one is
/// missing, or is another than it was. Those that did are on disk only meanwhile. `file`: the recording's, which errors of the scene in it
/// name before the scene's line.
Result<Scene> scene_of(const Recording& recording, const std::vector<std::filesystem::path>& mesh_folders = {},
                       const std::string& file = {});
/// The session that it begins with, before anything was done. Arguments and bad input as of scene_of, and of Session::create.
Result<Session> session_of(const Recording& recording, const Progress& progress = {},
                           const std::vector<std::filesystem::path>& mesh_folders = {}, const std::string& file = {});

/// A recording on its way: does what it says to a session of session_of, and compares. begin, then step until it is over.
class Replay {
 public:
  explicit Replay(const Recording& recording) : recording_(&recording) {}  ///< which outlives it
  /// What was done before the first step.
  void begin(Session& session);
  /// One step, and what was done after it. An Error: the step can't be taken; a difference is no error.
  Result<SessionStep> step(Session& session);
  [[nodiscard]] bool over() const { return report_.steps == recording_->last_step; }
  /// Of what was done so far. The score is there when it is over.
  [[nodiscard]] const ReplayReport& report() const { return report_; }

 private:
  void arrive(Session& session);
  const Recording* recording_;
  std::size_t change_ = 0, hash_ = 0;  ///< what comes next
  ReplayReport report_;
};

/// Runs a recording again and compares. An Error when it can't be run; a difference is no error. Arguments and bad input as of session_of.
Result<ReplayReport> replay(const Recording& recording, const Progress& progress = {},
                            const std::vector<std::filesystem::path>& mesh_folders = {}, const std::string& file = {});

/// Where two recordings part.
struct RecordingDifference {
  std::vector<std::string> settings;  ///< what was different to begin with: scene, meshes, time step ...
  std::int64_t first_change = -1;     ///< step of the first change that is not the same in both; -1: none
  std::string change_a, change_b;     ///< it, in words; "nothing more"
  std::int64_t first_hash = -1;       ///< first step at which both have a hash, and another; -1: none
  std::int64_t common_hashes = 0;     ///< steps at which both have one
  bool same_end = false;              ///< as many steps, and the same state after them
  [[nodiscard]] bool none() const { return settings.empty() && first_change < 0 && first_hash < 0 && same_end; }
};
RecordingDifference compare(const Recording& a, const Recording& b);

}  // namespace kerf
