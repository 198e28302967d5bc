// Overlap beside a cut that is none.
//
// What lies beside a cut is measured by its nearest places and by their directions. Where cuts turn, a wall may be met that stands before a place though
// nothing has moved; and what is nearest may be another wall in the next step. Material overlaps nothing at rest, and moves steadily.
//
//         |
//         |______       v faces the lip under it. It is measured against the wall
//                |      to its left as well, and lies behind that: at rest, and
//        ________v      wherever both go.
//
#pragma once

#include <cstdint>

#include "kerf/contact/detect_scratch.h"

namespace kerf {

/// How much of the overlap of a contact of a body with itself is none, m, >= 0. `c`: its gap as it is measured, the rest as it is handed out; `feature`: as it
/// will be remembered.
///   known, as it was        no more than ever since, and what it has got deeper all at once
///   known, at another       what is deeper than the gap that it has come to (RememberedContact::gap)
///     feature, or cut since
///   new as it is cut        of what lies by each other at rest: what is so at rest. What has moved into each other there comes apart
///   new, else               all: it would have been seen coming
/// None away from cuts, and none in a look at what a step has overlooked.
double allowed_overlap(const DetectRun& run, const Contact& c, std::uint64_t key, std::int32_t feature);

}  // namespace kerf
