// A blade's edge with a frame around it, and its move from one pose to the next through material that moves too.
//
// The frame goes along with the material near the blade, then turns with the edge by the shortest way, and never about it. The frame that a move ends with is
// the one that the next begins with. So a blade that goes along with a body that swings keeps still in its frame.
#pragma once

#include <span>

#include "kerf/base/vec.h"
#include "kerf/cutting/blade_edge.h"

namespace kerf {

struct BladeFrame {
  Vec3 base, along, aside, ahead;  ///< a place, metres; three unit vectors
  double length = 0;               ///< metres
  [[nodiscard]] Vec2 across(Vec3 p) const { return {dot(p - base, aside), dot(p - base, ahead)}; }
  [[nodiscard]] double depth(Vec3 p) const { return dot(p - base, along); }
  [[nodiscard]] BladeEdge edge() const { return {base, base + length * along}; }
};

/// One of the frames of an edge.
BladeFrame frame_of(const BladeEdge& edge);

/// Where vertices are before a move and after it, metres; the same array if nothing moves.
struct MovedMaterial {
  std::span<const Vec3> before, now;
  [[nodiscard]] bool is_still() const { return before.data() == now.data(); }
  [[nodiscard]] double farthest() const;  ///< metres that a vertex moves
};

struct BladeMove {
  BladeFrame was, is;
  /// Columns: how the material stretches across the blade, seen from its frame. It does so first, and then goes straight on.
  Vec2 turned[2] = {{1, 0}, {0, 1}};
  [[nodiscard]] Vec2 turn(Vec2 a) const { return a.x * turned[0] + a.y * turned[1]; }

  /// Through material that moves, as this does within `reach` metres of the blade, more or less.
  static BladeMove through(const MovedMaterial& material, const BladeFrame& from, const BladeEdge& to, double reach);
  /// Through material that has turned by `rotation`.
  static BladeMove make(const BladeFrame& from, const BladeEdge& to, const Mat3& rotation = {});
  /// Sets `turned` as vertices move within `reach` metres of the blade, more or less. The blade's way through material that stretches evenly is straight
  /// then.
  void go_along(const MovedMaterial& material, double reach);
};

/// Which boxes a move may pass, asked by where they are now.
class PassedBoxes {
 public:
  /// `farthest`: metres that what a box holds has moved, at most.
  PassedBoxes(const BladeMove& move, double farthest);
  [[nodiscard]] bool may_pass(const Box3& box) const;

 private:
  /// A direction of the blade's frame, before and now.
  struct Axis {
    Vec3 was, is;
    double offset_was = 0, offset_is = 0;  ///< of the frame's base
  };
  Axis axis(const BladeMove& move, Vec2 across) const;

  Axis along_, across_[2];    ///< the blade; its way, and square to it
  double turned_[2][2];       ///< BladeMove::turned in those
  double length_, farthest_;  ///< metres
  double rounding_;
};

/// A rigid motion of material: it turns about `was`, which comes to `is`.
struct MaterialMotion {
  Mat3 rotation;
  Vec3 was, is;  ///< metres
  [[nodiscard]] Vec3 moved(Vec3 p) const { return is + rotation * (p - was); }
  [[nodiscard]] BladeEdge moved(const BladeEdge& edge) const { return {moved(edge.base), moved(edge.tip)}; }
};

/// How material moves that lies within `reach` metres of a blade, more or less: least squares. What does not turn does so to the bit.
MaterialMotion motion_near(const MovedMaterial& material, const BladeEdge& was, const BladeEdge& is, double reach);
/// The same of what lay there before.
MaterialMotion motion_of(const MovedMaterial& material, const BladeEdge& was, double reach);

}  // namespace kerf
