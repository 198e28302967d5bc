// A trainer's score in one line.
#pragma once

#include <fmt/format.h>

#include <string>

#include "kerf/session/score.h"
#include "terminal.h"

namespace kerf::app {

inline std::string score_line(const TrainerScore& s) {
  return fmt::format(
      "lesion {:.0f} % removed, {:.1f} mm3 of other tissue ({:.1f} %), {} left, cut surface rough by {:.3f} mm, "
      "largest force {:.2f} N, {:.1f} s",
      100 * s.lesion_removed, 1e9 * s.healthy_removed, 100 * s.healthy_share, counted(s.loose_pieces, "loose piece"),
      1e3 * s.roughness, s.largest_force, s.time);
}

}  // namespace kerf::app
