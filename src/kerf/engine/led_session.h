// A session that a program leads while pages watch it: one of the two is in it at a time, in the order in which they come.
#pragma once

#include <cstdint>

#include "kerf/base/threads.h"
#include "kerf/session/session.h"

namespace kerf {

class LedSession {
 public:
  /// The session stays where it is until end() has been called and whoever looked then has left.
  explicit LedSession(Session& session) : session_(&session) {}
  LedSession(const LedSession&) = delete;
  LedSession& operator=(const LedSession&) = delete;
  ~LedSession() = default;

  // --- The program, one thread at a time ---------------------------------------------------------------------------
  /// Waits until nobody looks, or waits to look.
  void enter();
  /// `changes`: a number that grows with whatever pages can see.
  void leave(std::uint64_t changes);
  /// Between two steps: whoever waits looks first.
  void let_look(std::uint64_t changes);
  /// In between: what a step took.
  void stepped(const SessionStep& step) { last_step_ = step; }
  /// From now on nobody begins to look, and whoever waits to goes away. From any thread.
  void end();

  // --- Pages, one thread -------------------------------------------------------------------------------------------
  /// The session while nobody else is in it, for as long as this lives; nothing when it has ended.
  class Look {
   public:
    explicit Look(LedSession& led) : led_(led), looks_(led.begin_look()) {}
    ~Look() {
      if (looks_) led_.end_look();
    }
    Look(const Look&) = delete;
    Look& operator=(const Look&) = delete;
    explicit operator bool() const { return looks_; }

   private:
    LedSession& led_;
    bool looks_;
  };
  /// As of the last leave() or let_look().
  [[nodiscard]] std::uint64_t changes() const;
  /// While it looks.
  [[nodiscard]] Session& session() const { return *session_; }
  [[nodiscard]] const SessionStep& last_step() const { return last_step_; }

 private:
  bool begin_look();
  void end_look();

  Session* session_;
  SessionStep last_step_;
  mutable Mutex mutex_;
  Condition turn_;
  std::uint64_t changes_ = 0;
  bool led_ = false, looked_at_ = false, waits_to_look_ = false, ended_ = false;
};

}  // namespace kerf
