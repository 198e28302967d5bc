// Points and directions of a deformed body.
#include "kerf/contact/detect_scratch.h"

namespace kerf {
bool BodyView::off_faces(CollisionHalfEdge h, Vec3 direction, double most) const {
  if (dot(direction, into(h)) > most) return false;
  const CollisionHalfEdge g = surface.twin[h];
  return !g.valid() || dot(direction, into(g)) <= most;
}

BodyPoint vertex_point(const BodyView& body, CollisionVertex v) {
  BodyPoint p;
  p.where.body = body.index;
  p.where.vertex[0] = v;
  p.where.weight[0] = 1;
  p.position = body.position(v);
  p.offset = body.offset(v);
  p.travel = body.travel(v);
  return p;
}

BodyPoint edge_point(const BodyView& body, CollisionHalfEdge h, double t) {
  const CollisionVertex v = body.surface.from(h), w = body.surface.to(h);
  if (!(t > 0)) return vertex_point(body, v);
  if (!(t < 1)) return vertex_point(body, w);
  BodyPoint p;
  p.where.body = body.index;
  p.where.vertex = {v, w, CollisionVertex()};
  p.where.weight = {1 - t, t, 0};
  p.position = lerp(body.position(v), body.position(w), t);
  p.offset = lerp(body.offset(v), body.offset(w), t);
  p.travel = lerp(body.travel(v), body.travel(w), t);
  p.face = ContactSurface::face(h);
  return p;
}

BodyPoint face_point(const BodyView& body, CollisionTriangle f, const std::array<double, 3>& weight) {
  BodyPoint p;
  p.where.body = body.index;
  p.face = f;
  const auto corner = body.surface.vertices(f);
  std::size_t n = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!(weight[i] > 0)) continue;
    p.where.vertex[n] = corner[i];
    p.where.weight[n] = weight[i];
    p.position += weight[i] * body.position(corner[i]);
    p.offset += weight[i] * body.offset(corner[i]);
    p.travel += weight[i] * body.travel(corner[i]);
    ++n;
  }
  return p;
}

int opposite_corner(const std::array<double, 3>& weight) {
  int zeros = 0, at = -1;
  for (int i = 0; i < 3; ++i)
    if (!(weight[static_cast<std::size_t>(i)] > 0)) ++zeros, at = i;
  return zeros == 1 ? at : -1;
}

}  // namespace kerf
