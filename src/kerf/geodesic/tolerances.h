// Tolerances of the geodesic module. None decides topology: a bad choice costs a slightly longer path or some time.
#pragma once

namespace kerf {

/// Radians. A bend is moved to the other side of its vertex only if that side is smaller than pi by more than this:
/// the gain is of second order (1e-16 of the length), less would follow rounding to and fro.
constexpr double kSwitchAngle = 1e-8;
/// Of the length. Straightening stops when a round gains less.
constexpr double kStraightenGain = 1e-14;
/// Rounds of straightening before the strip is taken as it is; each moves every bend over one vertex.
constexpr int kStraightenRounds = 100000;
/// Of an edge. A crossing this close to an end goes through the end vertex (if free): rounding of the unfolding.
constexpr double kThroughVertex = 1e-9;
/// Of an edge. Where a path bends around a wall vertex, its crossings keep this distance from it. Only to be strictly
/// inside the edge: whoever inserts the path chooses the real margin.
constexpr double kWallClearance = 1e-6;
/// Weight of the distance still to go in the search for a corridor: above 1 it looks at far fewer edges and
/// straightening repairs what it loses.
constexpr double kCorridorGreed = 1.3;
/// Of the straight distance. A plane cut longer than this has met a fold and is dropped for the corridor search.
constexpr double kPlaneCutDetour = 2.0;

}  // namespace kerf
