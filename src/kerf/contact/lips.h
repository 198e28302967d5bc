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

/// One smooth piece of rim at a vertex. Where a rim turns sharply (two cuts cross) the vertex has two.
struct RimEnd {
  Vec3 conormal;              ///< unit, out of the material
  std::array<Vec3, 2> along;  ///< along the rim's edges, away from the vertex; zero: none
};
struct RimVertex {
  std::array<RimEnd, 2> end;
  int count = 0;              ///< 0: no rim, or the tip of a cut
};
/// Rims at a vertex, from edges made by cuts alone: the outer border would tilt them.
RimVertex rim_at(const BodyView& body, CollisionVertex v);

/// The nearest place on a facing lip.
struct LipFoot {
  CollisionHalfEdge edge;   ///< none: nothing faces
  double t = 0;             ///< on it
  double score = HUGE_VAL;  ///< lower is nearer
  Vec3 normal;              ///< unit, from the other lip to this one
};
/// Takes edge h (made by a cut) if it faces the rim at v and is nearer than what was found.
void offer_lip(const BodyView& body, const BodyPoint& v, const RimEnd& rim, CollisionHalfEdge h, LipFoot& best);

/// How far the walls are apart where they are nearest to or deepest in each other, m.
double lip_gap(const BodyPoint& v, const BodyPoint& foot, Vec3 normal);

}  // namespace kerf
