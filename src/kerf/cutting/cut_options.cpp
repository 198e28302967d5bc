#include "kerf/cutting/cut_options.h"

#include <fmt/format.h>

namespace kerf {

Status check_cut_options(const CutOptions& options) {
  if (options.layers < 1 || options.layers > 1000)
    return bad_input(fmt::format("cut: {} layers of cut surface; choose 1 to 1000", options.layers));
  if (!(options.minimum_feature >= 0 && options.minimum_feature <= 0.25))
    return bad_input(
        fmt::format("cut: a minimum_feature of {}; choose 0 to 0.25 edge lengths", options.minimum_feature));
  if (!(options.path_tolerance >= 0))
    return bad_input(fmt::format("cut: a path_tolerance of {}; it must not be negative", options.path_tolerance));
  if (!(options.roughness >= 0 && options.roughness <= 0.5))
    return bad_input(fmt::format("cut: a roughness of {}; choose 0 to 0.5", options.roughness));
  return {};
}

}  // namespace kerf
