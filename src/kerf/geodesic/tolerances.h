// Tolerances of the geodesic module. None decides topology: a bad choice costs a slightly longer path or some time.
#pragma once

#include <cstddef>

namespace kerf {

/// Radians. A bend is moved to the other side of its vertex only if that side is smaller than pi by more than this:
/// the gain is of second order (1e-16 of the length), less would follow rounding to and fro.
constexpr double kSwitchAngle = 1e-8;
/// Of the length. Straightening stops when a round gains less.
constexpr double kStraightenGain = 1e-14;
/// Rounds of straightening before the strip is taken as it is; each moves every bend over one vertex.
constexpr int kStraightenRounds = 10000;
/// Of the straight distance. A path from a plane cut that is longer may have gone the wrong way around a bump: the
/// corridor search gives a second one to choose from.
constexpr double kSecondSeed = 1.1;
/// Times that loops are cut out of one strip before it is taken as it is.
constexpr int kLoopRounds = 16;
/// Of an edge. A crossing this close to an end goes through the end vertex (if free): rounding of the unfolding.
constexpr double kThroughVertex = 1e-9;
/// Of an edge. Where a path bends around a wall vertex, its crossings keep this distance from it. Only to be strictly
/// inside the edge: whoever inserts the path chooses the real margin.
constexpr double kWallClearance = 1e-6;
/// Weight of the distance still to go in the search for a corridor: above 1 it looks at far fewer edges and
/// straightening repairs what it loses.
constexpr double kCorridorGreed = 1.3;
/// Edges that a path crosses. Edges as long as the path mislead the corridor search by their middles, so a path over so few is looked for exactly if it
/// makes a detour. Of 1,000 boxes of 12 to 44 triangles 240 are drawn more than 0.05 collision edges beside their parameters without, 8 at a
/// quarter, none at half; at double nothing but time.
constexpr std::size_t kFewCrossings = 16;
/// Of the straight distance: what a detour is. At 1.1 three of those boxes, at 1.05 none; at 1.01 nothing but time.
constexpr double kDoubtfulDetour = 1.02;
/// Of the straight distance. A plane cut longer than this has met a fold and is dropped for the corridor search.
constexpr double kPlaneCutDetour = 2.0;

/// Of the length. The exact search drops whatever gains less on a path that is already known.
constexpr double kExactGain = 1e-12;
/// Of the length. Two lengths of the exact search are different only beyond this: rounding of the unfolding.
constexpr double kSameLength = 1e-12;
/// Of an edge. Narrower windows are dropped, and a line that misses a window by less counts as inside.
constexpr double kWindowWidth = 1e-11;
/// Radians. A vertex bends shortest paths only with this much more than a full (or, beside a wall, half) turn.
constexpr double kBendAngle = 1e-9;
/// The exact search gives up after this many windows (2 GB, half a minute) and the local path is kept. Windows grow with
/// the square of the path's length in edges times its possible width: only paths across a whole large body come near.
constexpr int kMaxWindows = 20'000'000;
/// More windows than this are not kept as scratch for the next path (120 MB).
constexpr int kKeptWindows = 1'500'000;

}  // namespace kerf
