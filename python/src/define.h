// The parts of the extension module.
#pragma once

#include <nanobind/nanobind.h>

#include "kerf/picture/session_picture.h"
#include "kerf/scene/scene.h"

namespace kerf::python {

void define_bodies(nanobind::module_& m);
/// Session, Snapshot and what its pictures need. After strokes and recordings, whose types its signatures name.
void define_sessions(nanobind::module_& m);
void define_strokes(nanobind::module_& m);
void define_recordings(nanobind::module_& m);
/// What plays recordings: after sessions.
void define_plays(nanobind::module_& m);
void define_batches(nanobind::module_& m);

/// "rest" or "world". ValueError, TypeError: something else.
SceneFrame frame_of(nanobind::handle name);
PictureView view_of(nanobind::handle eye, nanobind::handle target, nanobind::handle up, double field_of_view);

/// The constructor of a class whose objects come from elsewhere: a TypeError that says whence.
template <class T>
auto refuse_to_make(const char* whence) {
  return [whence](T*, const nanobind::args&, const nanobind::kwargs&) { throw nanobind::type_error(whence); };
}
inline const nanobind::sig kRefusesToMake{"def __init__(self) -> typing.NoReturn"};

/// copy and deepcopy of what never changes: itself. The signatures are for the stubs.
template <class T>
void copy_is_itself(nanobind::class_<T>& made, const nanobind::sig& copy, const nanobind::sig& deepcopy) {
  using Self = nanobind::handle_t<T>;
  constexpr const char* kWhy = "Itself: it never changes.";
  made.def(
      "__copy__", [](Self self) { return nanobind::borrow(self); }, copy, kWhy);
  made.def(
      "__deepcopy__", [](Self self, nanobind::handle) { return nanobind::borrow(self); }, nanobind::arg("memo"),
      deepcopy, kWhy);
}

}  // namespace kerf::python
