// Ctrl-C during long work that goes on without Python's lock.
#pragma once

#include <nanobind/nanobind.h>

#include <chrono>
#include <string_view>
#include <thread>

#include "kerf/base/progress.h"
#include "python_lock.h"

namespace kerf::python {

/// Looks from time to time whether Python wants the work to end. Made by the thread that holds Python's lock, asked without it.
class Interrupts {
 public:
  /// Is the work to end? Looks at most every 30 ms, and only where Python listens: in the thread that began.
  bool wanted() {
    if (std::this_thread::get_id() != thread_) return false;  // what follows is this thread's alone
    if (wanted_) return true;
    if (python_ends()) return true;  // and nobody is told: the thread never has Python's lock again
    const auto now = std::chrono::steady_clock::now();
    if (now < next_) return false;
    next_ = now + std::chrono::milliseconds(30);
    const WithPythonLock lock;
    wanted_ = PyErr_CheckSignals() != 0;
    return wanted_;
  }
  /// With Python's lock held again: what the signal's handler raised goes on its way.
  void raise() const {
    if (wanted_) throw nanobind::python_error();
  }
  Progress listener() {
    return Progress([this](std::string_view, double) { return !wanted(); });
  }

 private:
  std::thread::id thread_ = std::this_thread::get_id();
  std::chrono::steady_clock::time_point next_ = std::chrono::steady_clock::now() + std::chrono::milliseconds(30);
  bool wanted_ = false;
};

}  // namespace kerf::python
