// The two lips of a cut, which start out touching.
//
// The wall of a lip stands on the rim: the plane through the rim along the thickness. How far apart two walls are is measured
// along their conormals (in the surface, out of the material), at both ends of the wall of a vertex: a distance with
// a sign that never flips, exactly zero for a fresh cut.
#pragma once

#include <array>
#include <cstdint>

#include "kerf/contact/detect_scratch.h"

namespace kerf {

/// Rims at a vertex, from edges made by cuts alone: the outer border would tilt them. Good until another vertex is asked about.
const RimVertex& rim_at(const BodyView& body, CollisionVertex v);
/// Out of the material at an edge made by a cut: unit, in its face.
Vec3 out_of_rim(const BodyView& body, CollisionHalfEdge h);
/// The same at t on the edge: smooth rims share it at their vertices.
Vec3 out_of_rim_at(const BodyView& body, CollisionHalfEdge h, double t);

/// The wall of a lip over a point of its rim: unit, upright to rim and thickness, out of the material.
Vec3 wall_normal(Vec3 conormal, Vec3 offset);

/// The nearest place on a facing lip.
struct LipFoot {
  CollisionHalfEdge edge;   ///< none: nothing faces
  double t = 0;             ///< on it
  double score = HUGE_VAL;  ///< lower is nearer
  Vec3 conormal;            ///< unit, out of the other lip's material
};
/// Takes edge h (made by a cut) if it faces the rim at v and is nearer than what was found.
void offer_lip(const BodyView& body, const BodyPoint& v, const RimEnd& rim, CollisionHalfEdge h, LipFoot& best);

/// Is a vertex the outer corner of a piece, between two walls?
bool is_outer_corner(const RimVertex& rim);
/// The edges that run on from h along its lip, up to its corners or so many on either side; h as well.
struct LipRun {
  static constexpr int kMost = 12;
  std::array<CollisionHalfEdge, 2 * kMost + 1> edge;
  int count = 0;
  [[nodiscard]] bool has(CollisionHalfEdge h) const;
};
LipRun lip_run(const BodyView& body, CollisionHalfEdge h);
/// Where cuts cross, a wall may face two lips. Takes edge h as offer_lip() does if it belongs to another lip than `first`, and v is beside it, not beyond its end.
void offer_second_lip(const BodyView& body, const BodyPoint& v, const RimEnd& rim, CollisionHalfEdge h,
                      const LipRun& first, LipFoot& best);

/// Where two walls meet, at one end of the height that they share: at the height of either one's end, a corner against a wall.
struct LipEnd {
  BodyPoint foot;  ///< on the other rim
  double lift = 0, other_lift = 0;
  Vec3
      normal;  ///< unit, from the other wall to this one: that of the wall which the other's corner meets, of both for two corners
  double gap = 0;  ///< m; HUGE_VAL: one wall is above the other
};
/// end 0: the upper one of v, 1: the lower one.
LipEnd lip_end(const BodyView& body, const BodyPoint& v, const RimEnd& rim, const LipFoot& foot, int end);

/// Where two cuts cross, four pieces meet with a corner each. The piece across has a wall on either side of its corner.
struct CornerFoot {
  CollisionVertex corner;   ///< none: nothing is across
  double score = HUGE_VAL;  ///< how far away it is, m
};
/// Takes vertex c if it is the corner across from v's and nearer than what was found.
void offer_corner(const BodyView& body, const BodyPoint& v, const RimVertex& rim, CollisionVertex c, CornerFoot& best);

/// A wall at the corner across, met by v's wall that faces it.
struct CornerWall {
  LipFoot foot;
  std::array<LipEnd, 2> ends;     ///< as of lips
  std::array<double, 2> later{};  ///< their gaps after the motion that is predicted, m
};
std::array<CornerWall, 2> corner_walls(const BodyView& body, const BodyPoint& v, const RimVertex& rim,
                                       CollisionVertex corner);

}  // namespace kerf
