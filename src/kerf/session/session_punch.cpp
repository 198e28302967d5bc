// A punch is a stroke that is over at once: one cut, one undo step.
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <utility>

#include "kerf/cutting/roughen.h"
#include "kerf/session/session_impl.h"

namespace kerf {
namespace {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

}  // namespace

Result<PunchReport> Session::Impl::punch(const Punch& punch, SceneFrame frame, double roughness) {
  if (!(roughness >= 0 && std::isfinite(roughness))) return bad_input(fmt::format("punch: a roughness of {} m; it must not be negative", roughness));
  KERF_TRY(finish_command_stroke());
  if (state.stroke) KERF_TRY(end_stroke());
  const auto start = Clock::now();
  std::vector<UndoStep> redo = std::move(state.redo);  // given back if nothing is cut
  KERF_TRY(begin_stroke(frame, true));
  const auto give_up = [&] {
    const Status cancelled = cancel_stroke();
    state.redo = std::move(redo);
    return cancelled;
  };
  sweep_positions = frame == SceneFrame::kRest ? state.body.complex.collision.rest.raw() : deformed_collision();
  auto cut = cut_punch(state.body.complex, sweep_positions, punch, cut_options, cut_scratch);
  if (!cut) {
    KERF_TRY(give_up());
    return cut.error();
  }
  PunchReport report;
  if (cut->opened_edges == 0) {
    KERF_TRY(give_up());
    return report;
  }
  roughen_punch(state.body.complex, *cut, roughness, static_cast<std::uint64_t>(scene.simulation.seed));
  CutTimes following;
  if (const Status followed = follow_complex(following); !followed) {
    KERF_TRY(give_up());
    return followed.error();
  }
  StrokeRecord& record = state.strokes.back();
  record.kind = StrokeRecord::Kind::kPunch;
  record.triangles = cut->steps;
  record.refused = cut->retries;
  record.times.total = seconds_since(start);
  record.times.embedding = following.embedding;
  record.times.cut_surface = std::exchange(cut_scratch.wall_seconds, 0.0);
  record.times.cut_and_binding = record.times.total - record.times.embedding - record.times.cut_surface;
  report.cut = true;
  report.loose = std::move(cut->loose);
  report.lips = std::move(cut->lips);
  KERF_TRY(end_stroke());
  report.times = state.strokes.back().times;
  return report;
}

Result<PunchReport> Session::punch(const Punch& punch, SceneFrame frame, double roughness) {
  return impl_->punch(punch, frame, roughness);
}

}  // namespace kerf
