// A path that was rolled back: what the blade passed and did not cut.
#pragma once

#include "kerf/base/vec.h"

namespace kerf {

enum class UncutReason {
  kNone,
  kNoVertex,  ///< no room for a vertex between those that are there
  kNoEdge,    ///< two of its vertices share no face
  kPinch,     ///< the material would hang together at a single point
  kCrumbs,    ///< all that it opens would cut off crumbs: nothing is missing, and nothing is noted
  kBusy,      ///< other paths of the move had cut there
};

struct UncutPath {
  UncutReason reason = UncutReason::kNone;  ///< kNone: all was cut
  Vec3 at;                                  ///< one of its points, at rest, metres
};

/// "there was no room for ...": the rest of a sentence for people.
constexpr const char* text_of(UncutReason reason) {
  switch (reason) {
    case UncutReason::kNone: return "all was cut";
    case UncutReason::kNoVertex: return "there was no room for a vertex between those that are there";
    case UncutReason::kNoEdge: return "its points do not follow each other over the mesh";
    case UncutReason::kPinch: return "the material would have hung together at a single point";
    case UncutReason::kCrumbs: return "only crumbs would have come off";
    case UncutReason::kBusy: return "other parts of the same move had cut there";
  }
  return "";
}

}  // namespace kerf
