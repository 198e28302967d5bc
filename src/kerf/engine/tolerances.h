// Numbers that decide how the page's tools work.
#pragma once

#include <cstddef>

namespace kerf {

/// Of half the thickness and a mean edge: so far a blade that is held upright stands out of the skin on both sides, for skin that bends
/// between two poses. Half or double: the same lips.
inline constexpr double kBladeReach = 2;
/// Mean edges around it over which the skin says how the blade stands. Half: small triangles at the end of a cut, which spring, lay it down, and the
/// cut ends before the rim. Double: lips are askew where skin bends.
inline constexpr double kBladeStands = 0.5;
/// Mean edges of the skin from one pose of the scalpel to the next. Half: the same lips. Double: where the skin bends, lips lie three times
/// as far beside the pointer.
inline constexpr double kScalpelWay = 2;
/// Mean edges between the skin under two rays that hardly differ, above which it ends there, and what is seen beyond lies behind. Half and double: the
/// same cuts of 138 strokes into the mouth of a tube. Larger than skins lie apart: what is between them is cut too.
inline constexpr double kLeap = 0.7;
/// Halvings of the way between two rays to find that place: rays that differ less are below a pixel.
inline constexpr int kHalvings = 14;
/// Ends of the skin between two rays that are looked for: a bound of the time.
inline constexpr int kMostEnds = 8;
/// Poses from one ray to the next, which may lie far apart on something seen edge-on: a bound of the time of one message.
inline constexpr int kMostParts = 64;

/// Of the reach of a finger at the rim: so far beside the rim a stroke begins or ends. Half: skin that bends hides the rim from the ray. Double:
/// a ray beside one rim meets the body behind the next.
inline constexpr double kOverRim = 0.25;
/// Of that reach: so far the hand goes before a stroke has begun that came down near the rim. Half: a click nicks the rim. Double: the cut is seen late.
inline constexpr double kRimWay = 0.25;
/// Cosine between a stroke's way on the screen and the way out over the rim, above which it goes there by itself. Half: a stroke that leaves the
/// rim on the slant starts in the body. Double: a nick is cut back out beside itself.
inline constexpr double kLeadsOverRim = 0.5;
/// Places of the rim that are tried, the nearest first: a bound of the time.
inline constexpr std::size_t kMostRimPlaces = 8;

/// Of the body's size: a hand reaches so far at most.
inline constexpr double kFarthestPull = 2;
/// Cosine between a ray and the normal of the plane that a hand follows, at least: below, the place in the plane is out of any reach.
inline constexpr double kAlongThePlane = 1e-3;
/// Cosine between the view and gravity above which what lies free is carried level.
inline constexpr double kFromAbove = 0.3;
/// Of the body's size: so high is carried what lies free. Half: a piece of the steak pushes away the one that it shall lie on. Double: it swings, and
/// comes to lie a seventh of the body's size beyond the pointer.
inline constexpr double kCarryHeight = 0.25;

/// Times what an export took: so long none is made behind it. Exports have a fifth of the time, whatever pages ask for. At half, they have a third;
/// at double, pages wait twice as long for files.
inline constexpr double kExportRest = 4;

/// Radii from one bite of a punch that is dragged to the next. From 2 on circles do not meet, and webs are left between them.
inline constexpr double kNextBite = 1.4;
/// How jagged a bite is, in radii.
inline constexpr double kJagged = 0.15;
/// Radii beside the body at most from which it bites on its way: what a jagged bite near the rim leaves of the body is in reach of the next. Where it
/// is put down or lifted, a whole radius. At 0.4 a drag may leave a web at the rim.
inline constexpr double kPassing = kNextBite - (1 - 2 * kJagged);
/// Radii from one place to the next where a punch on its way looks for its next bite. Half and double: the same tests pass.
inline constexpr double kLookOn = 0.1;
/// Such places between two samples: a bound of the time of one message.
inline constexpr double kMostLooks = 1000;
/// Sizes beside the body from which an instrument is as deep in the picture as what it passes by; farther, as what it worked on last.
inline constexpr double kBesideSizes = 4;

}  // namespace kerf
