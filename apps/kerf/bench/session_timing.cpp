#include "bench/session_timing.h"

#include <cmath>
#include <numbers>
#include <span>

#include "kerf/base/random.h"

namespace kerf::bench {
namespace {

constexpr int kWarmUps = 3;

/// Mean edges along a side of a crumb: more than the smallest feature that is cut, less than dust in all bodies here.
constexpr double kCrumb = 0.06;

/// One stroke along `path` at once, the blade upright; timed unless `timings` is null.
Status cut_along(Session& session, std::span<const Vec3> path, double reach, CutTimings* timings) {
  const Vec3 up{0, 0, reach};
  const double begun = thread_seconds();
  KERF_TRY(session.begin_stroke(SceneFrame::kRest, false));
  KERF_TRY(session.move_blade(path[0] + up, path[0] - up));
  const double start = thread_seconds();
  for (const Vec3 p : path.subspan(1)) KERF_TRY(session.move_blade(p + up, p - up));
  const double cut = thread_seconds();
  KERF_TRY(session.end_stroke());
  const double ended = thread_seconds();
  const StrokeRecord& record = session.strokes().back();
  if (!timings || record.triangles == 0) return {};
  timings->whole.add(cut - start);
  timings->per_triangle.add((cut - start) / record.triangles);
  timings->begin_and_end.add(start - begun + ended - cut);
  timings->cut_and_binding.add(record.times.cut_and_binding);
  timings->embedding.add(record.times.embedding);
  timings->surface.add(record.times.cut_surface);
  timings->triangles += record.triangles;
  timings->refused += record.refused;
  return {};
}

Status undo_timed(Session& session, int depth, CutTimings* timings) {
  if (session.undo_depth() == depth) return {};
  const double start = thread_seconds();
  KERF_TRY(session.undo());
  if (timings) timings->undo.add(thread_seconds() - start);
  return {};
}

void finish(CutTimings& timings) {
  if (!timings.whole.values.empty()) timings.triangles /= static_cast<double>(timings.whole.values.size());
}

Box3 rest_box(const Session& session) {
  Box3 box;
  for (const Vec3 p : session.body().complex.collision.rest.raw()) box.add(p);
  return box;
}

}  // namespace

Result<CutTimings> time_cuts(Session& session, int cuts) {
  CutTimings timings;
  Random random(7);
  const Box3 box = rest_box(session);
  const Vec3 size = box.size();
  const double reach = box.diagonal();
  for (int i = -kWarmUps; static_cast<int>(timings.whole.values.size()) < cuts && i < 10 * cuts + 10; ++i) {
    const double angle = random.uniform(0, 2 * std::numbers::pi), shift = random.uniform(-0.25, 0.25);
    const Vec3 along{std::cos(angle), std::sin(angle), 0}, across{-along.y, along.x, 0};
    const Vec3 middle = box.center() + shift * Vec3{across.x * size.x, across.y * size.y, 0};
    const Vec3 path[] = {middle - reach * along, middle + reach * along};
    CutTimings* const to = i < 0 ? nullptr : &timings;
    const int depth = session.undo_depth();
    KERF_TRY(cut_along(session, path, reach, to));
    KERF_TRY(undo_timed(session, depth, to));
  }
  finish(timings);
  return timings;
}

Result<CutTimings> time_short_cuts(Session& session, int cuts, double length, std::uint64_t seed) {
  CutTimings timings;
  Random random(seed);
  const Box3 box = rest_box(session);
  const Vec3 size = box.size();
  for (int i = 0; i < cuts; ++i) {
    const double angle = random.uniform(0, 2 * std::numbers::pi);
    const Vec3 along = length * Vec3{std::cos(angle), std::sin(angle), 0};
    const Vec3 from =
        box.center() + Vec3{size.x * random.uniform(-0.48, 0.48), size.y * random.uniform(-0.48, 0.48), 0};
    const Vec3 path[] = {from, from + along};
    KERF_TRY(cut_along(session, path, box.diagonal(), &timings));
  }
  finish(timings);
  return timings;
}

Result<Sample> time_dust(Session& session, int strokes) {
  Sample times;
  Random random(13);
  const Box3 box = rest_box(session);
  const Vec3 size = box.size(), up{0, 0, box.diagonal()};
  const double crumb = kCrumb * session.body().complex.mean_root_edge;
  for (int i = 0; i < strokes; ++i) {
    const Vec3 c = box.center() + Vec3{size.x * random.uniform(-0.3, 0.3), size.y * random.uniform(-0.3, 0.3), 0};
    const int depth = session.undo_depth();
    KERF_TRY(session.begin_stroke(SceneFrame::kRest, false));
    for (const Vec3 p : {Vec3{-0.3, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, -0.3, 0}})
      KERF_TRY(session.move_blade(c + crumb * p + up, c + crumb * p - up));
    const double start = thread_seconds();
    KERF_TRY(session.end_stroke());
    if (session.strokes().back().removed.pieces > 0) times.add(thread_seconds() - start);
    if (session.undo_depth() > depth) KERF_TRY(session.undo());
  }
  return times;
}

Result<Sample> time_poses(Session& session, int cuts, bool moving) {
  Sample times;
  Random random(11);
  const Box3 box = rest_box(session);
  const Vec3 c = box.center(), size = box.size(), up{0, 0, box.diagonal()};
  for (int i = 0; i < cuts; ++i) {
    const double angle = random.uniform(0, 2 * std::numbers::pi);
    const Vec3 along{size.x * std::cos(angle), size.y * std::sin(angle), 0};
    const int depth = session.undo_depth();
    KERF_TRY(session.begin_stroke(SceneFrame::kRest, false));
    for (int k = 0; k <= 50; ++k) {
      const Vec3 p = c + (-0.6 + 0.025 * k) * along;
      const double start = thread_seconds();
      KERF_TRY(session.move_blade(p + up, p - up));
      if (k > 0) times.add(thread_seconds() - start);
      if (moving) KERF_TRY(session.step(1));
    }
    KERF_TRY(session.end_stroke());
    if (session.undo_depth() > depth) KERF_TRY(session.undo());
  }
  return times;
}

Result<CutTimings> time_notches(Session& session, const std::vector<Vec3>& centres, double radius) {
  CutTimings timings;
  const Box3 box = rest_box(session);
  const Vec3 middle = box.center();
  for (std::size_t i = 0; i < centres.size() + kWarmUps; ++i) {
    const bool warm_up = i < kWarmUps;
    const Vec3 c = centres[warm_up ? i % centres.size() : i - kWarmUps];
    // From outside around the centre and out again.
    const double away = std::atan2(c.y - middle.y, c.x - middle.x);
    std::vector<Vec3> path;
    for (int k = 0; k <= 12; ++k) {
      const double angle = away + 2 * std::numbers::pi * k / 12;
      path.push_back(c + radius * Vec3{std::cos(angle), std::sin(angle), 0});
    }
    CutTimings* const to = warm_up ? nullptr : &timings;
    const int depth = session.undo_depth();
    KERF_TRY(cut_along(session, path, box.diagonal(), to));
    KERF_TRY(undo_timed(session, depth, to));
  }
  finish(timings);
  return timings;
}

Result<HandFrames> time_cutting_frames(Session& session, int strokes, int poses, const LookAtFrame& look) {
  HandFrames times;
  Random random(17);
  const Box3 box = rest_box(session);
  const Vec3 size = box.size(), up{0, 0, box.diagonal()};
  std::vector<Vec3f> positions, normals;
  for (int i = 0; i <= strokes; ++i) {
    const double angle = random.uniform(0, 2 * std::numbers::pi), shift = random.uniform(-0.2, 0.2);
    const Vec3 along{0.6 * size.x * std::cos(angle), 0.6 * size.y * std::sin(angle), 0};
    const Vec3 middle = box.center() + shift * Vec3{-along.y, along.x, 0};
    const int depth = session.undo_depth();
    KERF_TRY(session.begin_stroke(SceneFrame::kWorld, true));
    for (int k = 0; k <= poses; ++k) {
      const Vec3 p = middle + (2.0 * k / poses - 1) * along;
      const double start = thread_seconds();
      KERF_TRY(session.move_blade(p + up, p - up));
      const double cut = thread_seconds();
      const auto step = session.step();
      if (!step) return step.error();
      const double stepped = thread_seconds();
      session.visual_skin(positions, normals);
      const double end = thread_seconds();
      if (i == 0) continue;  // memory is touched
      times.frame.add(end - start);
      times.cut.add(cut - start);
      times.step.add(stepped - cut);
      times.surface.add(end - stepped);
      if (look) look(*step, cut - start, stepped - cut, end - stepped);
    }
    KERF_TRY(session.end_stroke());
    if (session.undo_depth() > depth) KERF_TRY(session.undo());
  }
  return times;
}

Result<FrameTimings> time_frames(Session& session, int frames) {
  FrameTimings timings;
  std::vector<Vec3f> positions, normals;
  session.visual_skin(positions, normals);
  for (int i = 0; i < frames; ++i) {
    const double start = thread_seconds();
    const auto step = session.step();
    if (!step) return step.error();
    const double stepped = thread_seconds();
    session.visual_skin(positions, normals);
    const double end = thread_seconds();
    timings.frame.add(end - start);
    timings.surface.add(end - stepped);
    timings.mechanics.add(step->mechanics.seconds_total);
  }
  return timings;
}

}  // namespace kerf::bench
