#include "kerf/contact/search_sides.h"

namespace kerf {

SidePlace side_place(const NearShape& near, SidePoint at) {
  const ContactSurface& s = near.body.surface;
  const auto v = s.vertices(at.face);
  Vec3 rest;
  for (std::size_t k = 0; k < 3; ++k) rest += at.weight[k] * (s.rest[v[k]] + at.lift * s.offset[v[k]]);
  at.carrier = near.body.state.sides->holds(rest) ? EmbeddedPoint{} : embed_point(*near.body.state.hex, at.face, rest);
  SidePlace place{at, {}};
  if (at.carrier.copy.valid()) place.place = place_of(*near.body.state.hex, at.carrier, near.body.state.nodes);
  return place;
}

void hand_out_side_contact(const NearShape& near, const SidePoint& at, Vec3 place, Vec3 travel, Proximity proximity) {
  const ContactName name{ContactKind::kSideShape, 0,        near.body.index, near.shape.other(), near.part,
                         at.face.value,           at.number};
  const std::uint64_t key = contact_key(name);
  const RememberedContact* r = recall(near.run, key);
  if (r != nullptr && is_passing(near.run.before, key)) r = nullptr;
  const bool mesh = near.placed.part->kind == PartKind::kMesh;
  if (r != nullptr && dot(r->normal, proximity.normal) < 0 &&
      (proximity.two_sided || (proximity.distance < 0 && !mesh))) {
    if (proximity.two_sided) {
      proximity.normal = -proximity.normal;
      proximity.distance = -proximity.distance;
    } else {
      proximity.normal = r->normal;
      proximity.distance = distance_along(near.placed, place, r->normal);
      proximity.point = place - proximity.distance * r->normal;
    }
  }
  const BodyPoint foot = face_point(near.body, at.face, at.weight);
  // What a side meets lies before it: behind it is the body, and what the other side meets.
  const double most = r != nullptr ? 0 : -kFacing;
  const bool faces = at.lift * at.lift == 1 && dot(proximity.normal, at.lift * normalized(foot.offset)) < most;
  if (!faces && !(at.border.valid() && dot(proximity.normal, near.body.into(at.border)) > -most)) return;
  hand_out_place(near.run, key, near.shape, foot, at, place, travel, proximity);
}

}  // namespace kerf
