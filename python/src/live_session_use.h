// How a thread has a session.
#pragma once

#include <memory>
#include <utility>

#include "errors.h"
#include "kerf/engine/led_session.h"
#include "live_session.h"
#include "python_lock.h"

namespace kerf::python {

/// A session in use by this thread. Errors: it is closed, or another thread is in it.
class LiveSession::Use {
 public:
  explicit Use(LiveSession& live) : live_(live) {
    if (live.busy_.exchange(true))
      throw Failure(
          failed("this session is in use by another thread; give each thread a session of its own, or a lock"));
    if (live.session_) {
      if (const auto view = live.view()) enter(view->led());
      return;
    }
    live.busy_ = false;
    throw Failure(bad_input("this session is closed"));
  }
  ~Use() {
    live_.stop_watching_where_due();
    if (led_) led_->leave(live_.changes_);
    live_.busy_ = false;
  }
  Use(const Use&) = delete;
  Use& operator=(const Use&) = delete;
  Session& operator*() { return *live_.session_; }
  Session* operator->() { return &*live_.session_; }

  /// From now on it is shared with who looks at it.
  void enter(std::shared_ptr<LedSession> led) {
    led->enter();
    led_ = std::move(led);
  }
  /// Something has changed, and more is to come: whoever waits looks first.
  void let_look() {
    ++live_.changes_;
    if (led_) led_->let_look(live_.changes_);
  }
  void take_step(SessionStep step) {
    live_.last_step_ = std::move(step);
    if (led_) led_->stepped(live_.last_step_);
    let_look();
  }

 private:
  const Call call_;
  LiveSession& live_;
  std::shared_ptr<LedSession> led_;
};

}  // namespace kerf::python
