// Threads and locks, where a platform has them. Where it has none (KERF_ONE_THREAD), what another thread would do is done at once, and
// nothing is locked: nobody else is there.
#pragma once

#ifndef KERF_ONE_THREAD
#include <condition_variable>
#include <mutex>
#include <thread>
#endif

namespace kerf {

#ifdef KERF_ONE_THREAD

struct Mutex {};
struct TryToLock {};
inline constexpr TryToLock kTryToLock;

class Lock {
 public:
  explicit Lock(Mutex& /*mutex*/) {}
  Lock(Mutex& /*mutex*/, TryToLock /*try_to_lock*/) {}
  Lock(const Lock&) = delete;
  Lock& operator=(const Lock&) = delete;
  ~Lock() = default;
  explicit operator bool() const { return true; }
};

struct Condition {
  void notify_all() {}
};

/// What it has to do is done when it has been made.
class Thread {
 public:
  Thread() = default;
  template <class Work>
  explicit Thread(Work&& work) {
    work();
  }
  [[nodiscard]] bool joinable() const { return false; }
  void join() {}
};

#else

using Mutex = std::mutex;
using Lock = std::unique_lock<std::mutex>;
using TryToLock = std::try_to_lock_t;
inline constexpr TryToLock kTryToLock;
using Condition = std::condition_variable;
using Thread = std::thread;

#endif

}  // namespace kerf
