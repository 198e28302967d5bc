#include "python_lock.h"

#include <pthread.h>

#include <atomic>
#include <chrono>
#include <thread>

namespace nb = nanobind;

namespace kerf::python {
namespace {

// s: that Python's end waits for threads at most. A step or a part of a cut takes milliseconds, what is bound looks for an end every tenth of
// a second. With half of it a thread of a large body may be at work while the process takes itself apart; double is a long wait for nothing.
constexpr double kLongestEnd = 2;

std::atomic<int> calls = 0;  // threads in the package that don't stand still
std::atomic<bool> ending = false;
std::atomic<std::thread::id> ends;  // the thread that ends Python
thread_local int depth = 0;         // Calls of this thread

[[noreturn]] void stand_still() {
  --calls;
  for (;;) pause();
}

/// Called by Python before it ends, with its lock.
void end_of_python() {
  ends = std::this_thread::get_id();
  ending = true;
  PyThreadState* state = PyEval_SaveThread();
  const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(kLongestEnd);
  while (calls > 0 && std::chrono::steady_clock::now() < until)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  PyEval_RestoreThread(state);
}

}  // namespace

Call::Call() {
  if (depth++ > 0) return;
  ++calls;
  if (!python_ends()) return;
  PyEval_SaveThread();
  stand_still();
}

Call::~Call() {
  if (--depth == 0) --calls;
}

WithoutPythonLock::~WithoutPythonLock() {
  if (python_ends()) stand_still();
  take_python_lock([this] { PyEval_RestoreThread(state_); });
}

void work_for_others() { depth = 1; }

bool python_ends() { return ending && ends.load() != std::this_thread::get_id(); }

void watch_pythons_end() {
  pthread_atfork(nullptr, nullptr, [] { calls = depth > 0 ? 1 : 0; });  // the others are not there
  nb::module_::import_("atexit").attr("register")(nb::cpp_function(&end_of_python));
}

}  // namespace kerf::python
