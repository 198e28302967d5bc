// Angles for people.
#pragma once

namespace kerf {

/// Degrees of a radian.
inline constexpr double kDegrees = 57.29577951308232;

}  // namespace kerf
