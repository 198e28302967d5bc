// The inside of an Engine. Private to engine*.cpp.
#pragma once

#include <array>
#include <chrono>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string_view>

#include "kerf/engine/client_queue.h"
#include "kerf/engine/drawn_body.h"
#include "kerf/engine/engine.h"
#include "kerf/engine/led_session.h"
#include "kerf/engine/picking.h"
#include "kerf/engine/scene_loader.h"
#include "kerf/scene/temporary_folder.h"

namespace kerf {

/// A file that a page is sending.
struct UploadedFile {
  std::string name, bytes;
  std::uint32_t total = 0;
};

/// Files that a page has asked for and that are not made yet.
struct PendingExport {
  std::uint32_t request = 0;
  std::vector<std::string> meshes;  ///< as of write_final_meshes
};

struct EngineClient {
  explicit EngineClient(std::size_t most_unread) : queue(most_unread) {}
  ClientQueue queue;
  bool ready = false;  ///< its Hello has come
  bool overlay = false, feet = false, contacts = false;
  std::uint32_t bad = 0;
  std::optional<PendingExport> exporting;
  std::map<std::pair<std::uint32_t, std::uint32_t>, UploadedFile> uploads;  ///< by upload and part
  std::size_t upload_bytes = 0;
};

/// A hand that follows the pointer in a plane through the point hit (engine_hand.cpp).
struct HandGrasp {
  std::string id;
  Vec3 plane_point, plane_normal;  ///< the normal points away from the eye
  Vec3 lift;                       ///< m: how far what is carried is lifted; zero: it is pulled
  double size = 0;                 ///< m: of the body
  Vec3 start;                      ///< where the grasp's centre was
};

/// A blade that stands square on the skin.
struct UprightBlade {
  Vec3 skin;  ///< where it goes in
  Vec3 base, tip;
};

/// A stroke of the scalpel that may begin and end at the rim.
struct RimStroke {
  double reach = 0;                     ///< parts of the distance from the eye; 0: it begins and ends where it is
  bool begun = false;                   ///< it cuts; else the hand has not gone on from where it came down
  std::vector<protocol::ViewRay> rays;  ///< until it has begun
  Vec3 here, before;                    ///< directions on its way, kRimWay apart: the last, and the one before
};

/// The instrument of an operation that is down: punch, scissors, shaver, suction or probe.
struct HandInstrument {
  double size = 0;          ///< metres
  std::size_t strokes = 0;  ///< of the session as it came down
  BodyCounts before;
  std::optional<Vec3> last;             ///< where it bit or snipped last, world, metres
  std::vector<protocol::ViewRay> rays;  ///< since it worked last; the last one stays
  double since_work = 0;                ///< s
  bool any = false;                     ///< it has done something
  int passes = 0;                       ///< of a shaver
  // Probe, and shaver
  std::optional<std::uint32_t> tool;  ///< number in the scene
  RigidPlace parked;                  ///< its pose as it came down
  std::vector<Vec3> surface;  ///< collision vertices as it came down: the probe follows the surface before it gave way
  Vec3 point, normal;         ///< under the pointer, and towards the eye
  double time = 0;            ///< s that it has been down
  double pressure = 0.5;
};

/// A ray at part t of the way between two; the eye may move on in a stroke.
protocol::ViewRay between(const protocol::ViewRay& a, const protocol::ViewRay& b, double t);

struct Engine::Impl {
  EngineOptions options;
  // The scene that is shown, as a LoadedScene brought it, and the one that is on its way
  SceneSource source;
  SceneOverrides overrides;
  std::optional<TemporaryFolder> folder;  ///< of an uploaded scene
  std::optional<UploadedMeshes> meshes;
  std::shared_ptr<Session> session;
  std::shared_ptr<const SessionSnapshot> initial;
  DrawnBody drawn;
  DrawnThings things;
  Box3 rest_box;  ///< of the visual mesh
  SceneScript script;
  Vec3 initial_gravity;
  SceneLoader loader;
  double since_progress = 0;

  // What the pages have
  std::uint32_t body = 0, version = 0;
  std::uint64_t published_topology = 0;
  std::size_t published_nodes = 0;
  struct OldPatch {
    std::uint32_t from;
    protocol::Message message;
  };
  std::deque<OldPatch> history;
  std::size_t history_bytes = 0;
  /// A message that says all there is of one thing; the same for all pages for as long as one of them has it to read, and the body is not cut.
  struct Told {
    std::uint32_t body = 0;
    std::uint64_t topology = 0;  ///< version of the session's
    std::weak_ptr<const protocol::Bytes> message;
  };
  Told body_told, things_told, fixed_told;
  std::array<Told, 2> overlay_told;  ///< without and with feet
  /// Of all messages that there are, with kMessageOverhead. Messages may live longer than the engine; all on its thread.
  std::shared_ptr<std::size_t> message_bytes = std::make_shared<std::size_t>(0);
  std::map<std::uint32_t, EngineClient> clients;
  std::uint32_t next_client = 1, holder = 0;
  std::uint32_t frame_seq = 0, last_input = 0;
  /// What the pieces weighed when they were weighed last.
  struct Weighed {
    std::uint32_t body = 0, version = 0;
    std::uint64_t topology = 0;
    double density = 0;  ///< kg/m^3, of the first material: others may change with it
    PieceMasses masses;
  } weighed;
  bool frame_due = true;
  bool tick_wanted = false;
  std::uint32_t exported_last = 0;  ///< client
  double export_rest = 0;           ///< s until the next export
  double since_frame = 0, since_stats = 0;

  // A program leads the session
  std::shared_ptr<LedSession> led;  ///< none: pages do
  std::uint64_t seen_changes = 0;
  std::uint64_t told_at = 0;  ///< changes that Score, Fixed and Masses have told of
  std::int64_t seen_steps = 0;
  double since_step = 0;  ///< s

  // Time
  bool playing = true;
  double tick_seconds = 0, left_of_budget = 0;  ///< s, of the tick under way
  bool watched = false, steps_due = false;
  double speed = 1, owed = 0;  ///< simulated seconds that real time is ahead
  struct StepTimes {
    std::deque<double> total;
    double mechanics = 0;
    std::int64_t steps = 0;  ///< since the last Stats
    int iterations = 0;
    double residual = 0;
  } times;
  BodyCounts counts;
  std::uint64_t counted_topology = 0;

  // Tools
  std::optional<protocol::Tool> tool;  ///< the one that is down
  std::optional<protocol::ViewRay> line_from;
  Vec3 scalpel_at;   ///< where the ray `line_from` met the skin
  Vec3 scalpel_out;  ///< how the blade stood there: unit, from its tip to its base
  RimStroke rim;
  std::optional<HandGrasp> hand;
  std::optional<HandInstrument> instrument;
  std::set<std::size_t>
      taken_with;  ///< strokes that are removals of what the punch before them cut loose: undone together
  std::vector<bool> jaws_closed;  ///< by tool: what its device asked for last
  std::uint32_t grasp_number = 0;
  Vec3 last_brush;
  struct PendingReport {
    protocol::CutReport report;
    std::string text;
  };
  std::optional<PendingReport> pending_report;

  // Recording
  std::vector<SessionChange> changes;
  std::vector<StateHash> hashes;
  bool recording = false;
  std::size_t recorded_bytes = 0;
  bool too_long = false;  ///< to be recorded: more happened than is kept

  // Memory without state
  std::vector<Vec3> shown_nodes;
  std::vector<Vec3f> nodes, fading_offset;
  std::vector<std::uint32_t> fading;
  std::vector<std::uint32_t> fixed, fixed_before;            ///< nodes, ascending
  std::vector<std::uint32_t> held_drawn, held_drawn_before;  ///< render vertices, ascending
  std::vector<protocol::Grasp> grasps;
  std::vector<std::uint32_t> held;
  DrawnContacts contacts;

  // engine.cpp
  void show(std::unique_ptr<LoadedScene> scene);
  void watch_loading(double real_seconds);
  void tell_loading(protocol::LoadState state, std::string_view stage, double fraction);
  void start_over();  ///< after load or reset: new body number, nothing recorded
  protocol::Message share(protocol::Bytes bytes);
  /// What is still told, or else what `make` gives.
  template <class Make>
  protocol::Message once(Told& told, Make&& make) {
    protocol::Message message = told.message.lock();
    if (message && told.body == body && told.topology == session->topology_version()) return message;
    message = share(make());
    told = {body, session->topology_version(), message};
    return message;
  }
  [[nodiscard]] std::size_t unread() const { return *message_bytes - history_bytes; }
  void send(std::uint32_t client, protocol::Bytes bytes);
  void broadcast(const protocol::Message& message);
  void error(std::uint32_t client, std::uint32_t input, protocol::ErrorCode code, std::string_view text);
  void hello(std::uint32_t client);
  void greet(std::uint32_t client, const protocol::PageHello& message);
  /// The body as it is, or was at a step since it has been cut: a frame with the present nodes follows.
  protocol::Message body_now();
  protocol::Message things_now();
  bool find_fixed();  ///< brings `fixed` and `held_drawn` up to date; true when that changed them
  protocol::Message fixed_now();
  /// Weighs the pieces where they may weigh something else than last time; not in a stroke, which would weigh them anew all the time.
  bool weigh();
  protocol::Message masses_now();
  [[nodiscard]] protocol::Role role_of(std::uint32_t client) const;
  void send_roles();
  protocol::Message overlay_now(bool feet);
  void send_overlay();
  void pass_tools(std::uint32_t to);
  void publish(std::uint32_t input);
  void fill_nodes();
  void send_frame();
  void send_stats(double real_seconds);
  void look_at_led();  ///< end_tick where a program leads
  void begin_steps(double real_seconds);
  bool step_due();
  bool single_step();
  const BodyCounts& current_counts();
  void handle(std::uint32_t client, const protocol::PageMessage& message);
  Recording make_recording() const;

  // engine_tools.cpp
  Status perform(SessionChange change);
  Status perform(SessionChange::Kind kind, std::vector<double> values = {});
  Status use_tool(const protocol::ToolInput& input);
  Status scalpel(const protocol::ToolInput& input);
  Status straight_cut(const protocol::ToolInput& input);
  Status pull(const protocol::ToolInput& input);
  Status take_hold(const protocol::ViewRay& ray, bool to_take_away);
  Status lead_hand(const protocol::ViewRay& ray);
  Status let_go(const protocol::ToolInput& input);
  CollisionTriangle held_triangle();  ///< one that the hand holds; none: what it held is gone
  Status brush(const protocol::ToolInput& input);
  Status lead_tool(const protocol::Device& device);
  /// On the skin that a ray meets, or beside the body where this would go on.
  UprightBlade upright(const protocol::ViewRay& ray);
  /// Its base on the side of `above`.
  UprightBlade upright(const protocol::ViewRay& ray, Vec3 above);
  /// Cuts what lies under the pointer from `line_from` to a ray.
  Status lead_scalpel(const protocol::ViewRay& ray);
  Status move_scalpel(const protocol::ViewRay& ray);
  Status place_scalpel(const UprightBlade& blade);
  /// The same, from over the rim where the stroke came down near it.
  Status follow_scalpel(const protocol::ViewRay& ray);
  /// Whether a blade meets the body where it stands.
  bool meets(const UprightBlade& blade);
  /// A ray just over the rim, beside which the blade stands, near one where it stands in the body. None where a way on the screen to `towards`
  /// (a direction) leads over that rim anyway, or where something of the body lies beside the rim.
  std::optional<protocol::ViewRay> over_rim(const protocol::ViewRay& ray, Vec3 towards);
  /// Out over the rim where a stroke ends near it.
  Status leave_over_rim(const protocol::ViewRay& ray, Vec3 before);
  Status finish_stroke(std::uint32_t input);
  void cancel_tool();
  /// The page that holds the tools is gone: what the scalpel has cut stays, everything else is cancelled.
  void leave_tool();
  void send_pending_report();
  void report_history(std::uint32_t input, protocol::Outcome outcome);
  std::optional<Picked> pick_ray(const protocol::ViewRay& ray);
  double brush_radius(CollisionTriangle triangle) const;

  // engine_instruments.cpp
  Status use_instrument(const protocol::ToolInput& input);
  /// What instruments do while they are down, besides messages.
  void work_instrument(double real_seconds);
  void put_down(const protocol::ToolInput& input);
  Status bite(const protocol::ToolInput& input);
  /// A bite where the ray meets the body or passes it by less than `near` metres, if that is far enough from the last one.
  Status bite_at(const protocol::ViewRay& ray, double near, const protocol::ToolInput& input);
  /// On the ray at the depth of the body; beside it, of where the instrument worked last.
  Vec3 at_depth(const protocol::ViewRay& ray);
  Status snip(const protocol::ToolInput& input);
  Status shave(double real_seconds);
  Status suck(bool now);
  Status probe(double real_seconds);
  Status push_shaver(double real_seconds);
  Status lead_in_hand(Vec3 view, Vec3 tip);
  void lift_tool();
  Status take_away(CollisionTriangle triangle, std::uint32_t input);
  bool holds(const std::string& grasp);
  /// Queues the report of all strokes since `first`; times are those of one of their parts.
  [[nodiscard]] std::size_t finished_strokes() const;
  void report_strokes(std::uint32_t input, std::size_t first, const BodyCounts& before, int parts = 1);
  std::optional<Picked> aim(const protocol::ViewRay& ray, double near);
  void send_score();

  // engine_commands.cpp
  Status command(std::uint32_t client, const protocol::Command& command);
  Status take_upload(EngineClient& client, const protocol::Upload& upload);
  Result<SceneRequest> upload_request(EngineClient& client, std::uint32_t upload, double unit,
                                      const std::string& thickness);
  Result<SceneRequest> other_unit(double unit) const;
  void begin_loading(SceneRequest request, std::uint32_t client, std::uint32_t input);
  Status export_files(std::uint32_t client, std::uint32_t request, const std::string& kind);
  Status make_export(std::uint32_t client, const PendingExport& wanted);
  /// Makes one of the pending exports, of the page behind the one that had its own last.
  void export_next();
  Status fix_rim();
};

protocol::Counts to_message(const BodyCounts& counts);

}  // namespace kerf
