// Waiting for another thread, without what only the newest C++ libraries have.
#pragma once

#include <chrono>

#include "kerf/base/threads.h"

namespace kerf {

#ifdef KERF_ONE_THREAD

/// It is true: there is nobody who could make it so.
template <class Predicate>
void wait_for(Condition& /*condition*/, Lock& /*lock*/, Predicate /*is*/) {}

#else

/// Waits until `is` is true. std::condition_variable::wait is a symbol of libstdc++ 12; programs that call this run with older ones.
template <class Predicate>
void wait_for(Condition& condition, Lock& lock, Predicate is) {
  while (!condition.wait_until(lock, std::chrono::system_clock::now() + std::chrono::hours(1), is)) {}
}

#endif

}  // namespace kerf
