// The sides of a face against a part of a shape: their points, and of each piece between them the place that is nearest to the part.
#pragma once

#include <algorithm>
#include <cmath>

#include "kerf/contact/near_shape.h"
#include "kerf/contact/side_points.h"
#include "kerf/contact/tolerances.h"
#include "kerf/contact/triangle_foot.h"

namespace kerf {

/// A place of a body's sides and the nearest place on a part.
void hand_out_side_contact(const NearShape& near, const SidePoint& at, Vec3 place, Vec3 travel, Proximity proximity);

/// How far from a place that moves like this something can be and still matter, m.
inline double side_reach(const NearShape& near, CollisionTriangle f, Vec3 travel) {
  return near.body.frame.thickness[near.body.surface.vertices(f)[0].index()] + near.run.margin +
         kApproach * (norm(travel) + near.shape_travel);
}

/// Where a place of a face's side is carried.
struct SidePlace {
  SidePoint at;
  CarriedPlace place;
};
SidePlace side_place(const NearShape& near, SidePoint at);

/// Looks for the place of a piece (three places of a side) that is nearest to the part, by projected descent from its middle: along the normal there, so far as the middle
/// of a round part is, else by less and less of its size. Hands it out if it is nearer than the piece's corners.
template <class Closest>
void search_side_piece(const NearShape& near, const SidePoint& middle,
                       const std::array<std::array<double, 3>, 3>& weight, Vec3 travel, const Proximity& first,
                       Closest&& closest) {
  std::array<Vec3, 3> corner;
  double least = HUGE_VAL, size = 0;
  bool same = true;
  const double reach = side_reach(near, middle.face, travel);
  for (std::size_t k = 0; k < 3; ++k) {
    SidePoint at = middle;
    at.weight = weight[k];
    const SidePlace p = side_place(near, at);
    if (!p.at.carrier.copy.valid()) return;
    corner[k] = p.place.now;
    Proximity proximity;
    if (!closest(corner[k], HUGE_VAL, proximity)) return;
    least = std::min(least, proximity.distance);
    same = same && dot(proximity.normal, first.normal) > 1 - kSameNormal;
  }
  if (same) return;
  for (std::size_t k = 0; k < 3; ++k) size = std::max(size, norm(corner[(k + 1) % 3] - corner[k]));
  SidePlace best, now;
  Proximity nearest, proximity = first;
  nearest.distance = HUGE_VAL;
  Vec3 x = (1.0 / 3) * (corner[0] + corner[1] + corner[2]);
  for (int i = 0; i < kSideSteps; ++i) {
    const double way = near.placed.part->radius > 0 ? near.placed.part->radius + proximity.distance : size / (i + 1);
    const std::array<double, 3> w = nearest_foot(x - way * proximity.normal, corner).weights();
    SidePoint at = middle;
    for (std::size_t k = 0; k < 3; ++k) at.weight[k] = w[0] * weight[0][k] + w[1] * weight[1][k] + w[2] * weight[2][k];
    now = side_place(near, at);
    x = now.place.now;
    if (!now.at.carrier.copy.valid() || !closest(x, HUGE_VAL, proximity)) break;
    if (proximity.distance < nearest.distance) best = now, nearest = proximity;
  }
  const double thickness = near.body.frame.thickness[near.body.surface.vertices(middle.face)[0].index()];
  if (nearest.distance < std::min(reach, least - kSideNearer * thickness))
    hand_out_side_contact(near, best.at, best.place.now, best.place.next - best.place.now, nearest);
}

/// closest(place, reach, proximity): the nearest place on the part within reach, as closest_on_part.
template <class Closest>
void search_sides(const NearShape& near, CollisionTriangle f, Closest&& closest) {
  const SidePoints& sides = *near.body.state.sides;
  for (std::uint32_t i = sides.begin(f); i < sides.end[f]; ++i) {
    const SidePoint& at = sides.points[i];
    const PartKind kind = near.placed.part->kind;
    if (at.piece >= 0 && kind == PartKind::kPlane) continue;
    // Of a mesh the middle serves: what is nearest changes from one of its triangles to the next, and shook what lay on it.
    const bool piece = at.piece >= 0 && kind != PartKind::kMesh;
    Proximity proximity;
    const double reach = side_reach(near, f, sides.travel[i]) + (piece ? sides.size[i] : 0);
    if (!closest(sides.place[i], reach, proximity)) continue;
    if (piece) search_side_piece(near, at, side_piece(sides.pieces[f], at.piece), sides.travel[i], proximity, closest);
    else hand_out_side_contact(near, at, sides.place[i], sides.travel[i], proximity);
  }
}

}  // namespace kerf
