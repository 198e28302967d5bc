#include "kerf/engine/led_session.h"

#include "kerf/base/wait_for.h"

namespace kerf {

void LedSession::enter() {
  Lock lock(mutex_);
  wait_for(turn_, lock, [&] { return !looked_at_ && !waits_to_look_; });
  led_ = true;
}

void LedSession::leave(std::uint64_t changes) {
  const Lock lock(mutex_);
  changes_ = changes;
  led_ = false;
  turn_.notify_all();
}

void LedSession::let_look(std::uint64_t changes) {
  Lock lock(mutex_);
  changes_ = changes;
  if (!waits_to_look_) return;
  led_ = false;
  turn_.notify_all();
  wait_for(turn_, lock, [&] { return !looked_at_ && !waits_to_look_; });
  led_ = true;
}

void LedSession::end() {
  const Lock lock(mutex_);
  ended_ = true;
  turn_.notify_all();
}

std::uint64_t LedSession::changes() const {
  const Lock lock(mutex_);
  return changes_;
}

bool LedSession::begin_look() {
  Lock lock(mutex_);
  waits_to_look_ = true;
  wait_for(turn_, lock, [&] { return !led_ || ended_; });
  waits_to_look_ = false;
  looked_at_ = !ended_;
  if (ended_) turn_.notify_all();
  return looked_at_;
}

void LedSession::end_look() {
  const Lock lock(mutex_);
  looked_at_ = false;
  turn_.notify_all();
}

}  // namespace kerf
