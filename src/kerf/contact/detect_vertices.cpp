// Vertices of a body against the surfaces of rigid shapes: one nearest point each.
#include "kerf/contact/detect_scratch.h"

namespace kerf {

void detect_vertices(DetectRun& run, const BodyView& body, const ShapeRef& shape, std::int32_t part,
                     const PlacedPart& placed) {
  const ContactSurface& surface = body.surface;
  const double shape_travel = run.options.step * greatest_speed(*shape.shape);
  ContactName name{ContactKind::kVertexShape, 0, body.index, shape.other(), part, 0, 0};
  for (const std::uint32_t leaf : run.scratch.leaves)
    surface.tree.for_each_triangle(leaf, [&](CollisionTriangle f) {
      for (int i = 0; i < 3; ++i) {
        const CollisionHalfEdge h = ContactSurface::corner(f, i);
        if (!surface.owns_vertex(h)) continue;
        const CollisionVertex v = surface.origin[h];
        const double reach = norm(body.offset(v)) + run.margin + kApproach * (body.frame.travel[v.index()] + shape_travel);
        Proximity near;
        if (!closest_on_part(placed, body.position(v), reach, near)) continue;
        name.feature = v.value;
        if (near.two_sided) {  // it stays on the side it was on
          const RememberedContact* r = recall_either_end(run, name);
          if (r != nullptr && dot(r->normal, near.normal) < 0) {
            near.normal = -near.normal;
            near.distance = -near.distance;
          }
        }
        hand_out_shape(run, name, shape, vertex_point(body, v), near.point, near.normal, near.distance, -1);
      }
    });
}

}  // namespace kerf
