// How far points and edges lie beside the walls of cuts (lips.h says what a wall is). What is farther beside one than it is deep in the faces behind it
// does not lie on them.
#pragma once

#include <algorithm>
#include <cmath>

#include "kerf/contact/detect_scratch.h"

namespace kerf {

/// What did not touch across a cut a step ago is never deeper in each other than this part of the radius: it would have been seen
/// coming. It lies side by side, or has passed over.
inline constexpr double kPassed = 0.1;
/// Walls of lips that share so many times as much height as they overlap beside each other are side by side, however deep.
inline constexpr double kClearly = 3;
/// A vertex stays with the lip or the face that it touched unless the other is better by this part of the radius.
inline constexpr double kStay = 0.1;

/// Directions are next to each other up to this cosine.
inline constexpr double kNextTo = 0.7;

/// How far a point of a prism is from a wall, along the wall's conormal (out of its material) or along the direction
/// next to it that the point's own prism is upright to: whichever is more; negative: behind it.
inline double beside_wall(const BodyPoint& wall, Vec3 conormal, const BodyPoint& p) {
  const Vec3 d = p.position - wall.position;
  const auto along = [&](Vec3 n) { return dot(n, d) - std::fabs(dot(n, p.offset)) - std::fabs(dot(n, wall.offset)); };
  const double size = dot(p.offset, p.offset);
  if (!(size > 0)) return along(conormal);
  const Vec3 own = conormal - (dot(conormal, p.offset) / size) * p.offset;
  if (!(dot(own, own) > kNextTo * kNextTo)) return along(conormal);
  return std::max(along(conormal), along(normalized(own)));
}
/// How far a point is beside the walls that a cut left on a face: the farthest.
double beside_walls(const BodyView& body, CollisionTriangle f, const BodyPoint& p);
/// Does beside_walls() find a wall at a face?
bool has_walls(const BodyView& body, CollisionTriangle f);
/// How far all of edge h is beside the walls at edge g: the farthest.
double edge_beside_walls(const BodyView& a, CollisionHalfEdge h, const BodyView& b, CollisionHalfEdge g);

/// How far walls are from each other along the thickness, m; negative: the height that they share.
inline double above_wall(const BodyPoint& x, const BodyPoint& y) {
  return std::fabs(dot(normalized(x.offset + y.offset), x.position - y.position)) - norm(x.offset) - norm(y.offset);
}
/// Walls that are deep in each other at first sight have passed over each other, unless beside is clearly the shorter way out: a cut has just made them,
/// of what had moved together where its tip was.
inline bool have_passed(double gap, double above, double radius) {
  return gap < -kPassed * radius && !(above < kClearly * gap);
}

}  // namespace kerf
