// Linear elastic, isotropic material with Rayleigh damping.
#pragma once

#include "kerf/base/result.h"
#include "kerf/base/vec.h"

namespace kerf {

/// Above this Poisson's ratio the incompatible-mode element starts to lock.
inline constexpr double kMaxPoisson = 0.49;

inline constexpr double kLeastPrestretch = 0.5, kMostPrestretch = 2;

struct Material {
  double young = 20e3;           ///< Young's modulus, Pa
  double poisson = 0.45;         ///< Poisson's ratio, 0 to kMaxPoisson
  double density = 1000;         ///< kg/m^3
  double damping_mass = 0;       ///< Rayleigh a, 1/s: damping force a M v
  double damping_stiffness = 0;  ///< Rayleigh b, s: damping force b K v
  /// Stretch at rest along the axes of the cell: 1.1 is pulled there to 1.1 of its natural length. kLeastPrestretch to kMostPrestretch.
  Vec3 prestretch{1, 1, 1};
};

/// Rejects what can't be simulated: stiffness or density not positive, Poisson's ratio out of range, negative
/// damping, anything not finite. The message names the field and the way out.
Status validate(const Material& material);

/// Lamé's first parameter, Pa.
constexpr double lame_lambda(const Material& m) {
  return m.young * m.poisson / ((1 + m.poisson) * (1 - 2 * m.poisson));
}
/// Shear modulus, Pa.
constexpr double lame_mu(const Material& m) { return m.young / (2 * (1 + m.poisson)); }

}  // namespace kerf
