// A session as Python sees it: it may be closed, it is used by one thread at a time, and its arrays outlive what happens to it.
#pragma once

#include <nanobind/nanobind.h>

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "arrays.h"
#include "kerf/picture/session_picture.h"
#include "kerf/record/recording.h"
#include "kerf/session/session.h"
#include "recorder.h"
#include "session_view.h"
#include "state_records.h"

namespace kerf::python {

/// A state of one session, to go back to; or one that came as bytes, for any session of the same scene.
struct Snapshot {
  std::shared_ptr<const SessionSnapshot> state;  ///< null: it came as bytes
  std::string bytes;                             ///< Session::state_bytes
  std::uint64_t session = 0;                     ///< number of the session that it was taken of
  bool in_hand = false;                          ///< a stroke by hand was open
  std::shared_ptr<const Recorder::Notes> notes;  ///< of the session's recording; null: there is none
};

/// A snapshot as a file of a saved session without a scene, for other processes. Throws Failure: a stroke was open.
std::string snapshot_bytes(const Snapshot& snapshot);
/// Back. Throws Failure: damaged, or of another version or instruction set.
Snapshot snapshot_of_bytes(std::string_view bytes);

class HeldRecording;
/// A dict; None where there is no score.
nanobind::object score_or_none(const std::optional<TrainerScore>& score);

/// What a session does in one turn of a batch.
struct SessionTurn {
  std::int64_t steps = 1;
  std::function<bool()> ended;       ///< asked before each step: are no more wanted?
  bool blade = false, cuts = false;  ///< is there a blade, and does it cut on its way?
  std::array<Vec3, 2> base, tip;     ///< of the blade: where it comes from, where it goes to; metres, world
  std::vector<std::pair<std::string, Vec3>> grasps;  ///< id, and where the grasp is at the end
  struct Tool {
    std::string id;
    Vec3 position, rotation;  ///< of the pose at the end; axis times angle
  };
  std::vector<Tool> tools;
};

class LiveSession {
 public:
  /// From the text of a scene; files that it names are looked for in `folder`, then in `meshes`. `name` stands for it in messages. bodies:
  /// MemoryBody of each name that stands for one in the scene. record: everything that is done is noted. scripted: the scene's commands run.
  LiveSession(const std::string& text, const std::string& name, const std::string& folder,
              const std::vector<std::string>& meshes, const nanobind::dict& bodies, bool record, bool scripted);
  /// As a recording begins.
  LiveSession(const HeldRecording& recording, const std::vector<std::string>& meshes);
  /// Goes on from what saved_bytes() gave, or from a file of it where `bytes` is null. `file` stands for both in messages.
  LiveSession(const char* bytes, std::size_t size, const std::string& file, const std::vector<std::string>& meshes);
  LiveSession(const LiveSession&) = delete;
  LiveSession& operator=(const LiveSession&) = delete;
  ~LiveSession();

  void step(std::int64_t n);
  void undo();
  void redo();
  void validate();
  void close();
  [[nodiscard]] bool closed() const { return !session_; }

  /// One stroke of a hand. Its number says whether a stroke is still this one.
  std::uint64_t begin_stroke(SceneFrame frame, bool through);
  void move_blade(std::uint64_t stroke, Vec3 base, Vec3 tip);
  void end_stroke(std::uint64_t stroke, bool keep);
  [[nodiscard]] bool stroke_is_open(std::uint64_t stroke);
  /// A whole stroke along `poses` edges; one of the scene's own blade ends first. On an error the body is as before. False: it met nothing.
  bool cut(const double* edges, std::size_t poses, SceneFrame frame, bool through);

  /// What came of a command that was given.
  struct Applied {
    bool stroke = false;  ///< it is one step of undo(), or a stroke that runs over the coming steps
    int removed = 0;      ///< pieces that it took away
  };
  /// Does the command in this text (parse_command) now. `name` stands for the text in messages.
  Applied apply(const std::string& text, const std::string& name);

  /// Goes on along a recording until so many steps are done; Ctrl-C ends it between two. Whatever came of it, `played` is told at its end,
  /// with Python's lock.
  void play(Replay& replay, bool& begun, std::int64_t until, const std::function<void()>& played);
  /// All that was done. Bad input: it was not noted, or recordings have no change for something of it.
  HeldRecording recording();

  // These need no lock of Python's.
  /// A turn: the blade goes on straight and evenly over the steps. `stroke`: number of the batch's own stroke, 0 for none. Throws Failure;
  /// what was done before that stays.
  void take_turn(const SessionTurn& turn, std::uint64_t& stroke);
  /// 3 `count` numbers from and to; kerf/session/material_places.h.
  void places_now(const double* rest, std::size_t count, double* now);
  void places_at_rest(const double* now, std::size_t count, double* rest, double* distance);
  BodyCounts body_counts();
  /// Heaviest first, kg.
  PieceMasses sorted_masses();
  /// Of the scene's tool of this id. Throws Failure: there is none.
  ToolRecord tool(const std::string& id);
  /// Of the grasp of this id; all 0 where there is none.
  GraspRecord grasp(const std::string& id);

  /// The session with all it needs elsewhere (saved_session.h).
  std::string saved_bytes();
  /// Writes them. Bad input: the file is one that the scene reads.
  void save(const std::string& file);

  Snapshot snapshot();
  void restore(const Snapshot& snapshot);
  /// How often.
  [[nodiscard]] std::uint64_t restores();

  double time();
  double time_step();
  std::int64_t steps();
  std::uint64_t hash();
  std::uint64_t topology_version();
  int undo_depth();
  int redo_depth();
  bool in_stroke();
  std::string name();
  std::string title();
  nanobind::dict counts();
  nanobind::dict last_step();
  std::vector<std::string> notes();
  std::string report_json();

  nanobind::object positions();
  nanobind::object velocities();
  nanobind::object normals();
  nanobind::object rest_positions();
  nanobind::object triangles();
  nanobind::object walls();
  nanobind::object uvs();
  nanobind::object collision_positions();
  nanobind::object collision_rest_positions();
  nanobind::object collision_triangles();
  nanobind::object nodes();
  nanobind::object node_velocities();
  nanobind::object hexahedra();
  // One record of state_records.h for each: bytes that Python sees as structured arrays.
  nanobind::object contacts();
  nanobind::object tools();
  nanobind::object grasps();
  std::vector<std::string> tool_ids();
  std::vector<std::string> grasp_ids();
  Vec3 support_force();

  // The page on it (session_view.h)
  void open_view(const ViewRequest& request);
  void close_view();
  /// Empty: there is no page on it.
  std::string view_address();
  int view_port();
  void expect_page(const std::string& ticket);
  /// In the child of a fork: the view is the parent's.
  void abandon_view();

  nanobind::dict material();
  void set_material(double young, double poisson, double density);
  Vec3 gravity();
  void set_gravity(Vec3 gravity);
  nanobind::object score();
  double roughness();
  std::pair<nanobind::object, double> piece_masses();

  /// The camera of the scene's picture, of so many pixels.
  PictureView fitted_view(int width, int height);
  /// An array of colours, or a tuple of that and one of depth. Without a view: fitted_view.
  struct PictureWish {
    bool depth = false;
    bool shadows = false;
    bool alpha = false;  ///< a fourth channel, 0 where the quick picture has nothing
  };
  nanobind::object render(int width, int height, std::optional<PictureView> view, PictureWish wish);

 private:
  class Use;
  [[nodiscard]] bool is_open(std::uint64_t stroke) const;
  void must_be_open(std::uint64_t stroke) const;
  /// Has the stroke by hand, which is open, cut anything so far?
  [[nodiscard]] bool hand_has_cut() const;
  void note(SessionChange::Kind kind, std::vector<double> values = {}) {
    if (recorder_) recorder_->note(*session_, kind, std::move(values));
  }
  /// Of a constructor: work that makes session_, without Python's lock; Ctrl-C ends it.
  void make(const std::function<Status(const Progress&)>& work);
  /// Of what came from elsewhere.
  void take_begin(const Recording& recording);
  /// A command, noted.
  Status perform(const SceneCommand& command);
  Result<SessionStep> step_once();
  /// After what may have ended it: its place among the strokes may be another one's next.
  void note_end_of_stroke();
  /// Made where it is first wanted, without Python's lock; in use by this thread.
  Status make_painter();
  std::shared_ptr<SessionView> view();
  /// Nobody looks any more.
  void forget_view(const std::shared_ptr<SessionView>& view);
  /// By who has it in use.
  void stop_watching_where_due();

  std::optional<Session> session_;  ///< none: closed
  std::atomic<bool> busy_ = false;  ///< a thread is in it
  Recording begin_;                 ///< what it was made of
  bool meshes_travel_ = false;      ///< the files of the scene have come with it
  std::mutex view_mutex_;           ///< of the pointer
  std::shared_ptr<SessionView> view_;
  std::atomic<bool> watched_in_vain_ = false;  ///< the session notes changes for a view that is gone
  std::uint64_t number_ = 0;
  std::uint64_t changes_ = 1;      ///< grows with everything that may move or cut the body
  std::uint64_t restores_ = 0;     ///< how often restore() went back
  std::uint64_t stroke_ = 0;       ///< number of the latest stroke by hand
  std::size_t stroke_record_ = 0;  ///< how many strokes there were with it; 0: it is over
  std::optional<SessionPainter> painter_;
  std::optional<Recorder> recorder_;  ///< none: nobody asked for one
  SessionStep last_step_;
  BodyCounts at_start_;
  double prepare_seconds_ = 0;
  KeptArray positions_, velocities_, normals_, rest_positions_, triangles_, walls_, uvs_, collision_positions_,
      collision_rest_, collision_triangles_, nodes_, node_velocities_, hexahedra_, contacts_, tools_, grasps_;
};

}  // namespace kerf::python
