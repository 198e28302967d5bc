// What a bind report says of where cuts will be drawn: one line for `kerf bind` and `kerf info`.
#pragma once

#include <fmt/format.h>

#include <string>

#include "kerf/binding/bind.h"

namespace kerf::app {

inline std::string placement_text(const BindReport& r) {
  std::string text =
      fmt::format("drawn beside their parameters by {:.2g} % of the mean edge on the mean, {:.2g} % at most",
                  100 * r.displacement.mean, 100 * r.displacement.largest);
  if (r.led_vertices > 0) text += fmt::format("; {} border vertices led to the rim", r.led_vertices);
  if (r.upright) text += "; not squashed";
  if (r.crossed_normals > 0) text += fmt::format("; normals cross at {} vertices", r.crossed_normals);
  if (r.upright_patches + r.uniform_patches > 0)
    text += fmt::format("; {} patches with upright and {} with uniform weights", r.upright_patches, r.uniform_patches);
  return text;
}

}  // namespace kerf::app
