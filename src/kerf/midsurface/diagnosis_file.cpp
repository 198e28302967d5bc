#include "kerf/midsurface/diagnosis_file.h"

#include <cmath>

#include "kerf/mesh/mesh_file.h"

namespace kerf {

Status write_diagnosis(const std::string& path, const MidsurfaceDiagnosis& d) {
  constexpr double kPlus[3] = {235, 130, 30}, kMinus[3] = {40, 110, 220},
                   kFlag[3][3] = {{200, 0, 40}, {150, 0, 200}, {250, 220, 0}};
  std::vector<std::array<std::uint8_t, 3>> colours(d.side.size());
  std::vector<float> flag(d.flag.begin(), d.flag.end());
  for (std::size_t f = 0; f < colours.size(); ++f) {
    const double strength = 0.35 + 0.65 * std::sqrt(static_cast<double>(d.confidence[f]));
    const double* base = d.flag[f] != 0 ? kFlag[d.flag[f] - 1] : d.side[f] > 0 ? kPlus : kMinus;
    for (std::size_t k = 0; k < 3; ++k)
      colours[f][k] = static_cast<std::uint8_t>(d.flag[f] != 0 ? base[k] : 235 + strength * (base[k] - 235));
  }
  return write_coloured_ply(
      path, d.surface, colours,
      {{"side", d.side}, {"confidence", d.confidence}, {"thickness", d.thickness}, {"flag", flag}});
}

}  // namespace kerf
