// Waiting for another thread, without what only the newest C++ libraries have.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>

namespace kerf {

/// Waits until `is` is true. std::condition_variable::wait is a symbol of libstdc++ 12; programs that call this run with older ones.
template <class Predicate>
void wait_for(std::condition_variable& condition, std::unique_lock<std::mutex>& lock, Predicate is) {
  while (!condition.wait_until(lock, std::chrono::system_clock::now() + std::chrono::hours(1), is)) {}
}

}  // namespace kerf
