// Vertices of a body against the surfaces of rigid shapes: one nearest point each.
#include "kerf/contact/detect_scratch.h"

namespace kerf {

void detect_vertices(DetectRun& run, std::int32_t body, const ShapeRef& shape, std::int32_t part,
                     const PlacedPart& placed) {
  const SurfaceState& state = run.bodies[static_cast<std::size_t>(body)];
  const ContactSurface& surface = *state.surface;
  const BodyFrame& frame = run.scratch.bodies[static_cast<std::size_t>(body)];
  const double shape_travel = run.options.step * greatest_speed(*shape.shape);
  ContactName name{ContactKind::kVertexShape, 0, body, shape.other(), part, 0, 0};
  SurfacePoint a;
  a.body = body;
  a.weight[0] = 1;
  for (const std::uint32_t leaf : run.scratch.leaves)
    surface.tree.for_each_triangle(leaf, [&](CollisionTriangle f) {
      for (int i = 0; i < 3; ++i) {
        const CollisionHalfEdge h = ContactSurface::corner(f, i);
        if (!surface.owns_vertex(h)) continue;
        const CollisionVertex v = surface.origin[h];
        const Vec3 x = state.position[v.index()], offset = state.offset[v.index()];
        const double reach = norm(offset) + run.margin + kApproach * (frame.travel[v.index()] + shape_travel);
        Proximity near;
        if (!closest_on_part(placed, x, reach, near)) continue;
        name.feature = v.value;
        name.slot = 0;
        if (near.two_sided) {  // it stays on the side it was on
          const RememberedContact* r = recall_either_end(run, name);
          if (r != nullptr && dot(r->normal, near.normal) < 0) {
            near.normal = -near.normal;
            near.distance = -near.distance;
          }
        }
        a.vertex[0] = v;
        hand_out_shape(run, name, shape, a, offset, state.predicted[v.index()] - x, near.point, near.normal,
                       near.distance, -1);
      }
    });
}

}  // namespace kerf
