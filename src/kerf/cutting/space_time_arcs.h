// What a blade cuts of a mesh while both move from one pose to the next: arcs, as in blade_arcs.h. They follow from where each vertex is beside the
// blade's line before and now. Seen along the blade, which is the origin, a vertex goes straight from `was` to `is`:
//
//        was o---.                   An edge sweeps a loop was - was - is - is. The blade crosses the edge as often as the loop
//           |     '---o is           winds round the origin: -1, 0 or 1 times.
//           |    x     \             A face has the blade in it, before or now, if its corners wind round the origin then.
//        was o---.      \            All loops are made of the same segments, and a segment says one thing: whether it crosses
//                 '------o is        the ray from the origin. So as much goes into a face as comes out of it, however numbers
//                                    are rounded: arcs neither branch nor break off, and moves that follow each other pass
//                                    each point of the material once.
//
// When the blade crosses an edge, and where on it, is a root of a quadratic.
#pragma once

#include <span>
#include <vector>

#include "kerf/cutting/blade_arcs.h"

namespace kerf {

/// A blade's edge with a frame around it.
struct BladeFrame {
  Vec3 base, along, aside, ahead;  ///< a place, metres; three unit vectors
  double length = 0;               ///< metres
  [[nodiscard]] Vec2 across(Vec3 p) const { return {dot(p - base, aside), dot(p - base, ahead)}; }
  [[nodiscard]] double depth(Vec3 p) const { return dot(p - base, along); }
  [[nodiscard]] BladeEdge edge() const { return {base, base + length * along}; }
};

/// One of the frames of an edge.
BladeFrame frame_of(const BladeEdge& edge);

/// A move of a blade. Its frame goes along with the edge, and does not turn about it: the frame that a move ends with is the one that the next begins with.
struct BladeMove {
  BladeFrame was, is;
  /// Columns: how the material turns and stretches across the blade in the move. It does so first, and then goes straight on.
  Vec2 turned[2] = {{1, 0}, {0, 1}};

  static BladeMove make(const BladeFrame& from, const BladeEdge& to);
  /// Sets `turned` as vertices move within `reach` metres of the blade, more or less. The blade's way through material that turns and stretches evenly is
  /// straight then.
  void go_along(std::span<const Vec3> before, std::span<const Vec3> now, double reach);
  [[nodiscard]] Vec2 turn(Vec2 a) const { return a.x * turned[0] + a.y * turned[1]; }
};

/// A front of a stroke.
struct MovingFront {
  Vec3 position;  ///< now
};

/// All arcs of a move, from where the vertices were `before` to where they are `now`; each goes on in time. An arc that begins where a front is, to within
/// `near` metres, begins with that front. Ends of the kind kBorder lie on borders. Cost: all vertices and faces.
std::vector<BladeArc> find_space_time_arcs(const CollisionMesh& mesh, std::span<const Vec3> before,
                                           std::span<const Vec3> now, const BladeMove& move,
                                           std::span<const MovingFront> fronts, double near);

}  // namespace kerf
