// A body against planes, balls, capsules and boxes.
#include <cmath>

#include "kerf/contact/near_shape.h"
#include "kerf/contact/search_sides.h"

namespace kerf {
namespace {

void test_edges(const NearShape& near, CollisionHalfEdge h, double reach, const ShapeEdge& edge) {
  const Vec3 a = near.body.position(near.body.surface.from(h)), b = near.body.position(near.body.surface.to(h));
  reach += edge.radius;
  for (int k = 0; k < 3; ++k)
    if (std::fmin(a[k], b[k]) > std::fmax(edge.a[k], edge.b[k]) + reach ||
        std::fmax(a[k], b[k]) < std::fmin(edge.a[k], edge.b[k]) - reach)
      return;
  SegmentFeet feet;
  if (inner_feet(a, b, edge.a, edge.b, feet)) hand_out_edges(near, h, edge, feet);
}

/// The memory of a vertex, or of a neighbour: things that slide deep in a sheet meet new vertices on the wrong side.
const RememberedContact* recall_around(const NearShape& near, ContactName name) {
  const ContactSurface& surface = near.body.surface;
  const CollisionVertex v(name.feature);
  if (const RememberedContact* r = recall_either_end(near.run, name)) return r;
  const RememberedContact* found = nullptr;
  surface.for_each_outgoing(v, [&](CollisionHalfEdge h) {
    for (const CollisionVertex w : {surface.to(h), surface.from(ContactSurface::prev(h))}) {
      name.feature = w.value;
      found = recall_either_end(near.run, name);
      if (found != nullptr) return false;
    }
    return true;
  });
  return found;
}

}  // namespace

void detect_simple(const NearShape& near, double reach) {
  const ContactSurface& surface = near.body.surface;
  DetectScratch& scratch = near.run.scratch;
  find_leaves(surface.tree, near.body.frame.boxes, near.placed, reach, scratch);
  all_features(near.placed, scratch.features);
  const bool features = !scratch.features.points.empty();
  const SidePoints* sides = near.body.state.sides;
  for (const std::uint32_t leaf : scratch.leaves)
    surface.tree.for_each_triangle(leaf, [&](CollisionTriangle f) {
      if (sides != nullptr)
        search_sides(near, f, [&](Vec3 place, double far, Proximity& proximity) {
          return closest_on_part(near.placed, place, far, proximity);
        });
      bool coarse = false;
      for (int i = 0; i < 3; ++i) {
        const CollisionHalfEdge h = ContactSurface::corner(f, i);
        coarse = coarse || surface.is_coarse_edge(h);
        if (!surface.owns_vertex(h)) continue;
        const CollisionVertex v = surface.origin[h];
        Proximity proximity;
        if (closest_on_part(near.placed, near.body.position(v), near.reach(v), proximity))
          hand_out_vertex_contact(near, v, proximity);
      }
      if (!coarse || !features) return;
      const double local_reach = near.reach(surface.vertices(f));
      if (surface.coarse[f] != 0) {
        const std::array<Vec3, 3> corner = near.body.corners(f);
        for (const ShapePoint& p : scratch.features.points) offer_point(near, f, corner, local_reach, p);
      }
      for (int i = 0; i < 3; ++i) {
        const CollisionHalfEdge h = ContactSurface::corner(f, i);
        if (!surface.owns_edge(h) || !surface.is_coarse_edge(h)) continue;
        for (const ShapeEdge& edge : scratch.features.edges) test_edges(near, h, local_reach, edge);
      }
    });
  hand_out_points(near);
}

void hand_out_vertex_contact(const NearShape& near, CollisionVertex v, Proximity proximity) {
  const ContactName name{ContactKind::kVertexShape, 0, near.body.index, near.shape.other(), near.part, v.value, 0};
  // What has come so deep that another way out is nearer goes back the way it came.
  const bool mesh = near.placed.part->kind == PartKind::kMesh;
  if (proximity.two_sided || (proximity.distance < 0 && !mesh)) {
    const RememberedContact* r = recall_around(near, name);
    if (r != nullptr && dot(r->normal, proximity.normal) < 0) {
      if (proximity.two_sided) {
        proximity.normal = -proximity.normal;
        proximity.distance = -proximity.distance;
      } else {
        const Vec3 x = near.body.position(v);
        proximity.normal = r->normal;
        proximity.distance = distance_along(near.placed, x, r->normal);
        proximity.point = x - proximity.distance * r->normal;
      }
    }
  }
  hand_out_shape(near.run, name, near.shape, vertex_point(near.body, v), proximity.point, proximity.normal,
                 proximity.distance, -1);
}

}  // namespace kerf
