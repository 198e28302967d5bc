// Python's lock: given up during long work, taken for a look at Python, and never wanted again by daemon threads once Python ends.
//
// While the interpreter ends, Python before 3.14 ends a thread that wants its lock by unwinding the stack. Destructors would end the whole
// process there. So threads that are in the package then stand still instead, as those of 3.14 do; Python's end waits until they do.
#pragma once

#include <nanobind/nanobind.h>

#include <unistd.h>

namespace kerf::python {

/// A thread is in the package, with Python's lock or without, as long as one of these lives. With the lock it may run Python, which may give
/// the lock up and take it again, only within one.
class Call {
 public:
  /// The caller has Python's lock, unless a Call of its thread lives already.
  Call();
  ~Call();
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;
};

/// This thread never has Python's lock, and ends with who leads it: its calls are not counted.
void work_for_others();
/// Is Python about to end, and this thread not the one that ends it? Long work ends early then.
bool python_ends();
/// Has all that done when Python ends; once.
void watch_pythons_end();

/// Takes Python's lock by `take`, or never comes back.
template <class Take>
auto take_python_lock(Take&& take) {
  try {
    return take();
  } catch (...) {  // the unwinding
    for (;;) pause();
  }
}

/// While it lives other threads may run Python.
class WithoutPythonLock {
 public:
  WithoutPythonLock() : state_(PyEval_SaveThread()) {}
  ~WithoutPythonLock();
  WithoutPythonLock(const WithoutPythonLock&) = delete;
  WithoutPythonLock& operator=(const WithoutPythonLock&) = delete;

 private:
  const Call call_;  // before the lock goes
  PyThreadState* state_;
};

/// Within the life of a WithoutPythonLock: Python's lock again.
class WithPythonLock {
 public:
  WithPythonLock() : state_(take_python_lock([] { return PyGILState_Ensure(); })) {}
  ~WithPythonLock() { PyGILState_Release(state_); }
  WithPythonLock(const WithPythonLock&) = delete;
  WithPythonLock& operator=(const WithPythonLock&) = delete;

 private:
  PyGILState_STATE state_;
};

/// Does something long without Python's lock.
template <class Work>
auto unlocked(Work&& work) {
  const WithoutPythonLock release;
  return work();
}

}  // namespace kerf::python
