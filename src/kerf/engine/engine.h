// The engine behind `kerf view`: one session, everything a page can do with it, and what every page has to be told. It
// knows messages (protocol.h), no sockets: whoever owns it hands in what pages send, calls tick() in real time, and
// carries away what next() gives. One thread at a time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "kerf/base/progress.h"
#include "kerf/base/result.h"
#include "kerf/engine/protocol.h"
#include "kerf/record/recording.h"
#include "kerf/session/session.h"

namespace kerf {

class LedSession;

/// A scene that a page may choose.
struct OfferedScene {
  std::string name, title, path;
  std::string goal = {};
};

struct EngineOptions {
  std::vector<OfferedScene> scenes;
  std::uint64_t session_id = 1;  ///< random per start: a page that knows another one gets the whole body
  std::vector<std::filesystem::path>
      mesh_folders;                    ///< where scenes that a page chooses find their meshes, beside their own folders
  double tick = 60;                    ///< Hz that the owner calls tick() with; pages are told
  SceneOverrides overrides{false, 0};  ///< a page is for cutting by hand: without the scene's own commands
  double step_budget = 0.012;          ///< s of computing per tick; what does not fit makes the simulation slower
  /// Bytes that a page has to read, from which on it is given up. A choice: what one dead page may cost. At half, a page that sleeps while others
  /// cut is sent away earlier and comes back to a new Body; at twice, it costs twice as much until it is found out.
  std::size_t most_unread = std::size_t{256} << 20;
  /// Bytes that all pages together have to read, each message once, from which on the one that has the most is given up: what others do is told
  /// to all, whether they read or not. Twice most_unread: at half, one page at its own limit would be given up by this one; at twice, pages that
  /// do not read cost 1 GiB.
  std::size_t most_unread_together = std::size_t{512} << 20;
  /// Bytes that a page has to read, from which on it is not listened to (holds_back). A page that reads has one answer to read when it asks
  /// again. At half, one that asks for two exports at once waits with more bodies; at twice, two such pages reach most_together, not four.
  std::size_t most_answers = std::size_t{16} << 20;
  /// Bytes that all pages have to read, from which on those are not listened to that have any: four times most_answers. At half, two slow pages
  /// hold all others back that have anything to read; at twice, pages that ask and do not read cost twice as much.
  std::size_t most_together = std::size_t{64} << 20;
  std::size_t patch_history = std::size_t{8} << 20;   ///< bytes of patches kept for pages that come back
  std::size_t most_recorded = std::size_t{64} << 20;  ///< bytes of changes; a longer session can't be recorded
  std::size_t most_upload = std::size_t{512} << 20;   ///< bytes of all uploads that are not loaded yet
  std::size_t most_checked = 40'000;  ///< visual triangles: larger bodies are not checked after each stroke (20 ms)
};

/// A page that sends this many bad messages is closed.
inline constexpr std::uint32_t kMostBadMessages = 100;

class Engine {
 public:
  /// Errors as of Session::create.
  static Result<Engine> create(const SceneSource& scene, EngineOptions options, const Progress& progress = {});
  /// Pages watch a session that a program leads; their tools and commands are refused. Ticks take no steps and tell what the program did. The
  /// program is in the session during this call. `source` is what the session was made of. Errors: its obstacles or tools can't be drawn.
  static Result<Engine> watch(std::shared_ptr<LedSession> led, SceneSource source, EngineOptions options);
  Engine(Engine&&) noexcept;
  Engine& operator=(Engine&&) noexcept;
  ~Engine();

  // --- Pages -----------------------------------------------------------------------------------------------------
  /// A page has connected; its number, from 1. It hears nothing before its Hello.
  std::uint32_t connect();
  /// It is gone: its stroke is taken back, its tools pass on.
  void disconnect(std::uint32_t client);
  /// A message of a page. Bad ones are answered and counted.
  void receive(std::uint32_t client, std::span<const std::byte> message);
  /// A message that is none of this protocol: answered with this sentence, and counted as bad.
  void refuse(std::uint32_t client, const std::string& why);
  /// The next message for a page, or null when there is none now.
  protocol::Message next(std::uint32_t client);
  /// Must it be closed: too many bad messages, or too much unread?
  [[nodiscard]] bool gives_up(std::uint32_t client) const;
  /// Has it so much unread that it must be closed without waiting for what is being sent? It may never take that.
  [[nodiscard]] bool overflows(std::uint32_t client) const;
  /// Shall it first read what it has been answered, and nothing more be read of it until then?
  [[nodiscard]] bool holds_back(std::uint32_t client) const;

  // --- Time ------------------------------------------------------------------------------------------------------
  /// This much real time has passed (s). Runs as many steps as fit, and tells the pages.
  void tick(double real_seconds);
  /// The same in parts, so that pages are heard between two steps: begin_tick, step_due until it is false, end_tick.
  void begin_tick(double real_seconds);
  bool step_due();  ///< takes a step if one is due and time is left; false: none was
  void end_tick();
  /// A page did something that the next tick shows: no need to wait for it.
  [[nodiscard]] bool tick_wanted() const;

  // --- State, for tests and reports ------------------------------------------------------------------------------
  [[nodiscard]] const Session& session() const;
  [[nodiscard]] bool playing() const;
  /// Is another scene on its way? tick() shows it when it is there.
  [[nodiscard]] bool loading() const;
  [[nodiscard]] std::uint32_t body() const;
  [[nodiscard]] std::uint32_t version() const;
  [[nodiscard]] std::uint32_t holder() const;
  [[nodiscard]] std::size_t client_count() const;
  /// Bytes of all messages that pages have still to read, each once, however many have it to read; without patches that are kept for pages
  /// that come back, with what is under way.
  [[nodiscard]] std::size_t unread() const;
  /// Everything done since the scene was loaded or reset, as a recording with a hash of the present state.
  [[nodiscard]] Recording recording() const;

 private:
  struct Impl;
  explicit Engine(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace kerf
