// Times of the clock on the wall, for reports. No result depends on them.
#pragma once

#include <chrono>

namespace kerf {

using Clock = std::chrono::steady_clock;

/// Seconds.
inline double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Stages that follow each other.
class Stopwatch {
 public:
  /// Seconds since the last call, or since it was made.
  double lap() {
    const Clock::time_point now = Clock::now();
    const double seconds = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    return seconds;
  }

 private:
  Clock::time_point last_ = Clock::now();
};

}  // namespace kerf
