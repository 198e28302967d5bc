// Numbers that decide how the page's tools work.
#pragma once

namespace kerf {

/// Of half the thickness and a mean edge: so far a blade that is held upright stands out of the skin on both sides, for skin that bends
/// between two poses. Half or double: the same lips.
inline constexpr double kBladeReach = 2;
/// Mean edges of the skin from one pose of the scalpel to the next. Half: the same lips. Double: where the skin bends, lips lie three times
/// as far beside the pointer.
inline constexpr double kScalpelWay = 2;
/// Poses from one ray to the next, which may lie far apart on something seen edge-on: a bound of the time of one message.
inline constexpr int kMostParts = 64;

}  // namespace kerf
