// Where the corners of a freshly bound body are drawn, beside where their parameters say: measured from planar coordinates, collision mesh and
// positions alone, with none of the library's functions for parameters.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "kerf/binding/cell_complex.h"

namespace kerf::testing_support {

/// In parts of the mean collision edge; means by area.
struct DrawnPlace {
  double mean = 0, largest = 0;
  double rim_mean = 0, rim_largest = 0;  ///< of corners whose parameters are within 0.05 edge of the rim
  int rim_corners = 0;
};

inline double distance_to_segment(Vec3 p, Vec3 a, Vec3 b) {
  const double t = std::clamp(dot(p - a, b - a) / dot(b - a, b - a), 0.0, 1.0);
  return norm(p - (a + t * (b - a)));
}

/// Faces of the skin flatter than 60 degrees to the mid-surface.
inline DrawnPlace drawn_place(const CellComplex& body) {
  const CollisionMesh& c = body.collision;
  const VisualMesh& v = body.visual;
  DrawnPlace out;
  double area = 0, rim_area = 0;
  for (std::int32_t f = 0; f < static_cast<std::int32_t>(v.face_count()); ++f) {
    const std::int32_t patch = v.patch[VisualTriangle(f)].value, t = patch / 2;
    std::array<Vec3, 3> x, r, o;
    std::array<Vec2, 3> q;
    for (std::int32_t k = 0; k < 3; ++k) {
      const auto i = static_cast<std::size_t>(k);
      x[i] = v.rest[v.origin[VisualHalfEdge(3 * f + k)]];
      r[i] = c.rest[c.origin[CollisionHalfEdge(3 * t + k)]];
      o[i] = c.offset[c.origin[CollisionHalfEdge(3 * t + k)]];
      q[i] = c.planar[CollisionHalfEdge(3 * t + k)];
    }
    const Vec3 face = cross(x[1] - x[0], x[2] - x[0]);
    for (std::int32_t k = 0; k < 3; ++k) {
      Vec2 p = v.planar[VisualHalfEdge(3 * f + k)];
      if (patch % 2 == 1) p.y = -p.y;
      // p = q0 + b (q1 - q0) + g (q2 - q0), by Cramer's rule.
      const Vec2 d = p - q[0], e = q[1] - q[0], g = q[2] - q[0];
      const double det = e.x * g.y - e.y * g.x, b = (d.x * g.y - d.y * g.x) / det, w = (e.x * d.y - e.y * d.x) / det;
      const Vec3 place = (1 - b - w) * r[0] + b * r[1] + w * r[2],
                 up = normalized((1 - b - w) * o[0] + b * o[1] + w * o[2]);
      if (std::fabs(dot(face, up)) < 0.5 * norm(face)) continue;
      Vec3 off = x[static_cast<std::size_t>(k)] - place;
      off = off - dot(off, up) * up;
      const double size = norm(off) / body.mean_root_edge;
      area += norm(face);
      out.mean += norm(face) * size;
      out.largest = std::max(out.largest, size);
      double rim = HUGE_VAL;
      for (std::int32_t s = 0; s < 3; ++s)
        if (!c.twin[CollisionHalfEdge(3 * t + s)].valid())
          rim = std::min(rim, distance_to_segment(place, r[static_cast<std::size_t>(s)],
                                                  r[static_cast<std::size_t>((s + 1) % 3)]));
      if (rim > 0.05 * body.mean_root_edge) continue;
      ++out.rim_corners;
      rim_area += norm(face);
      out.rim_mean += norm(face) * size;
      out.rim_largest = std::max(out.rim_largest, size);
    }
  }
  if (area > 0) out.mean /= area;
  if (rim_area > 0) out.rim_mean /= rim_area;
  return out;
}

}  // namespace kerf::testing_support
