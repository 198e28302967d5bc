// A stroke as Python sees it.
#pragma once

#include <nanobind/nanobind.h>

#include <cstdint>
#include <utility>

#include "arrays.h"
#include "errors.h"
#include "live_session.h"

namespace kerf::python {

/// One stroke; begins where `with` is entered.
class Stroke {
 public:
  Stroke(nanobind::object session, SceneFrame frame, bool through)
      : session_(std::move(session)), frame_(frame), through_(through) {}
  Stroke(Stroke&&) = default;
  Stroke& operator=(Stroke&&) = delete;
  /// A blade that nobody has any more is lifted: nothing else could end its stroke. While the session is at work it stays.
  ~Stroke() {
    if (number_ == 0 || !session_.is_valid()) return;
    try {
      if (is_open()) end();
    } catch (...) {  // NOLINT(bugprone-empty-catch): there is nobody to tell
    }
  }
  void enter() {
    if (number_ != 0) throw Failure(bad_input("this stroke has begun before; make another one"));
    number_ = live().begin_stroke(frame_, through_);
  }
  void move(nanobind::handle base, nanobind::handle tip) {
    const Vec3 from = place_of(base, "base"), to = place_of(tip, "tip");
    live().move_blade(number_, from, to);
  }
  void end() { live().end_stroke(number_, true); }
  void cancel() { live().end_stroke(number_, false); }
  /// What was cut stays, after an exception too. A stroke that is over already is none the worse for it.
  void exit(bool raised) {
    if (!live().closed()) {
      if (live().stroke_is_open(number_)) end();
    } else if (!raised) {
      throw Failure(bad_input("this session was closed within a stroke"));
    }
  }
  [[nodiscard]] bool is_open() { return !live().closed() && live().stroke_is_open(number_); }

  // For Python's collector: a session may hold its strokes.
  static int traverse(PyObject* self, visitproc visit, void* arg) {
    Py_VISIT(Py_TYPE(self));
    if (nanobind::inst_ready(self)) {
      const nanobind::handle session = nanobind::inst_ptr<Stroke>(self)->session_;
      Py_VISIT(session.ptr());
    }
    return 0;
  }
  static int clear(PyObject* self) {
    if (nanobind::inst_ready(self)) nanobind::inst_ptr<Stroke>(self)->session_.reset();
    return 0;
  }

 private:
  LiveSession& live() {
    if (!session_.is_valid()) throw Failure(bad_input("this stroke's session is gone"));  // the collector took it
    return nanobind::cast<LiveSession&>(session_);
  }
  nanobind::object session_;
  SceneFrame frame_;
  bool through_;
  std::uint64_t number_ = 0;
};

}  // namespace kerf::python
