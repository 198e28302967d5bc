// The exact geodesic: windows of straight lines pushed from s over the edges until t is reached (4.1.2).
//
// Chen and Han's propagation with the filter of Xin and Wang (2009), in the order of an A* search: a window waits by the
// shortest length that any path through it can have, and everything no better than a path already known is dropped.
// Walls are where the surface is cut open, so that every vertex on a wall has a distance for each corner between walls.
#pragma once

#include <cstdint>
#include <vector>

#include "kerf/geodesic/path_query.h"
#include "kerf/geodesic/sparse_index.h"
#include "kerf/geodesic/strip.h"

namespace kerf {

struct ExactSearch {
  /// Straight lines from one point through part of an edge. In the plane of the face the lines come from, the edge runs
  /// from (0, 0) along +x and that face lies above.
  struct Window {
    std::int32_t half_edge, parent;  ///< parent window, or -1: straight from a corner
    std::int32_t root;               ///< the corner where the lines start
    double begin, end;               ///< part of the edge, metres from from(half_edge)
    Vec2 source;
    double offset;  ///< distance of the root from s
  };
  /// A vertex, or one of the parts into which walls divide its fan.
  struct Corner {
    std::int32_t vertex, face;    ///< the face of the corner in which the path arrives
    double distance;              ///< of the shortest path to it known so far
    std::int32_t window, before;  ///< arrived through a window, or along an edge from another corner; else -1
    bool bends;                   ///< may a shortest path bend here?
  };
  /// The best line so far to the tip opposite an edge, and where it crosses the edge.
  struct Tip {
    double distance, crossing;
  };
  struct Event {
    double estimate;
    double distance;      ///< of a corner, when the event was made; a closer one has come since if it differs
    std::int32_t window;  ///< or -1
    std::int32_t corner;
  };
  SparseIndex corner_index, tip_index;
  std::vector<Corner> corners;
  std::vector<Tip> tips;
  std::vector<Window> windows;
  std::vector<Event> heap;
  std::vector<std::int32_t> route;  ///< scratch of the way back
};

enum class ExactOutcome {
  kShorter,    ///< the strip of the exact geodesic was found
  kNoShorter,  ///< no path is shorter than the bound
  kGaveUp,     ///< more than kMaxWindows windows
};

/// Looks for a path shorter than `upper_bound` (metres) by more than kExactGain; `strip` is set only when there is one.
/// Time about 1 microsecond a window.
ExactOutcome search_exact(const PathQuery& query, double upper_bound, Strip& strip, ExactSearch& scratch);

}  // namespace kerf
