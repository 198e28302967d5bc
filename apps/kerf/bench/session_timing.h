// Times of cuts, steps and frames of a session: what both benchmarks measure.
#pragma once

#include <functional>

#include "bench/timing.h"
#include "kerf/base/result.h"
#include "kerf/session/session.h"

namespace kerf::bench {

/// Times (s) of cuts. Whole cuts and poses by the thread's clock; stages, whose columns are those of the paper, by the clock on the wall.
struct CutTimings {
  Sample whole;                                ///< all updates; beginning and ending a stroke left out
  Sample per_triangle;                         ///< of a whole cut: its time over the collision triangles it entered
  Sample cut_and_binding, embedding, surface;  ///< stages of whole cuts
  Sample begin_and_end;                        ///< of the stroke: marks, counts
  Sample undo;
  double triangles = 0;  ///< mean number of collision triangles entered
  int refused = 0;       ///< degenerate steps that were rolled back
};

/// Straight cuts at random from border to border of the body as it is, each undone; for a body about flat in x and y.
Result<CutTimings> time_cuts(Session& session, int cuts);

/// Straight cuts at random of `length` metres, each from within to within, that stay.
Result<CutTimings> time_short_cuts(Session& session, int cuts, double length, std::uint64_t seed);

/// Ends of strokes around crumbs, which are swept up as dust then; each undone. No times where a body's crumbs are no dust.
Result<Sample> time_dust(Session& session, int strokes);

/// A cut drawn by hand across the body: time of every pose, a fortieth of the body apart; the provisional end included. Undone.
/// moving: the body swings, a step (not in the time) after every pose.
Result<Sample> time_poses(Session& session, int cuts, bool moving = false);

/// A notch punched out of the border about `centre` (rest frame, metres): a blade runs around it, out of the body and back out. Undone.
Result<CutTimings> time_notches(Session& session, const std::vector<Vec3>& centres, double radius);

struct FrameTimings {
  Sample frame;      ///< step and surface (positions and normals of the visual mesh)
  Sample mechanics;  ///< of it
  Sample surface;    ///< of it
};
/// Cuts by hand while the body moves: in every frame the blade takes a pose, a step is made, the surface follows. `poses` a stroke across
/// the body (world frame), every one undone.
struct HandFrames {
  Sample frame;  ///< all of it
  Sample cut, step, surface;
};
/// `look` is told every step, and the seconds of its frame: cut, step, surface.
using LookAtFrame = std::function<void(const SessionStep& step, double cut, double stepping, double surface)>;
Result<HandFrames> time_cutting_frames(Session& session, int strokes, int poses, const LookAtFrame& look = {});

/// Frames as they come.
Result<FrameTimings> time_frames(Session& session, int frames);

}  // namespace kerf::bench
