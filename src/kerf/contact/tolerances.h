// Numbers that decide which overlap beside a cut is none (allowed_overlap.cpp).
#pragma once

namespace kerf {

/// Half thicknesses of both: places that are new to each other as a cut is made, and nearer than this at rest, have not slid along each other. At a quarter,
/// twisted walls that bulge into each other are allowed to (Lips.TwistedWalls...). At half and double no test differs.
inline constexpr double kNearAtRest = 1;

/// Half thicknesses that a contact beside a cut gets deeper than its step has left it, at most: what turns does so by less. At half and double no test differs.
/// At four times, pieces of combs and polylines that are cut in a hanging plate are up to 1.8 times as fast.
inline constexpr double kJump = 0.01;

}  // namespace kerf
