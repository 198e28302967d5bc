#include "kerf/mechanics/material.h"

#include <fmt/format.h>

#include <cmath>

namespace kerf {

Status validate(const Material& m) {
  if (!(m.young > 0) || !std::isfinite(m.young))
    return bad_input(fmt::format("material: young = {} Pa must be a positive number", m.young));
  if (!(m.density > 0) || !std::isfinite(m.density))
    return bad_input(fmt::format("material: density = {} kg/m^3 must be a positive number", m.density));
  if (!(m.poisson >= 0) || !(m.poisson <= kMaxPoisson))
    return bad_input(
        fmt::format("material: poisson = {} must lie between 0 and {}: beyond that the elements lock; "
                    "use {} for a nearly incompressible material",
                    m.poisson, kMaxPoisson, kMaxPoisson));
  if (!(m.damping_mass >= 0) || !std::isfinite(m.damping_mass))
    return bad_input(fmt::format("material: damping_mass = {} 1/s must not be negative", m.damping_mass));
  if (!(m.damping_stiffness >= 0) || !std::isfinite(m.damping_stiffness))
    return bad_input(fmt::format("material: damping_stiffness = {} s must not be negative", m.damping_stiffness));
  for (int a = 0; a < 3; ++a)
    if (!(m.prestretch[a] >= kLeastPrestretch) || !(m.prestretch[a] <= kMostPrestretch))
      return bad_input(fmt::format("material: prestretch = {} along axis {} must lie between {} and {}; 1 is none",
                                   m.prestretch[a], "xyz"[a], kLeastPrestretch, kMostPrestretch));
  return {};
}

}  // namespace kerf
