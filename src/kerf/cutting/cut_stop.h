// What a path is cut along: vertices, and points where one is to be made.
#pragma once

#include "kerf/cutting/rest_point.h"

namespace kerf {

/// A point of a path.
struct CutStop {
  enum class Kind { kNone, kVertex, kEdge, kInside };
  Kind kind = Kind::kNone;
  CollisionVertex vertex;  ///< kVertex
  CollisionVertex a,
      b;  ///< kEdge: at `fraction` of the half-edge a - b; vertices keep their names while other edges are split
  double fraction = 0;
  RestPoint point;  ///< kInside

  static CutStop at_vertex(CollisionVertex v) { return {Kind::kVertex, v, {}, {}, 0, {}}; }
  static CutStop on_edge(CollisionVertex a, CollisionVertex b, double fraction) {
    return {Kind::kEdge, {}, a, b, fraction, {}};
  }
  static CutStop inside(const RestPoint& p) { return {Kind::kInside, {}, {}, {}, 0, p}; }

  [[nodiscard]] bool exists() const { return kind != Kind::kNone; }
  /// A border edge at it: its own, or the one that leaves its vertex; none inside the material.
  [[nodiscard]] CollisionHalfEdge border(const CollisionMesh& mesh) const {
    CollisionHalfEdge h;
    if (kind == Kind::kEdge) h = mesh.find_half_edge(a, b);
    if (kind == Kind::kVertex) h = mesh.fan_start(vertex);
    return h.valid() && mesh.is_border(h) ? h : CollisionHalfEdge{};
  }
  /// At rest, metres.
  [[nodiscard]] Vec3 place(const CollisionMesh& mesh) const {
    if (kind == Kind::kVertex) return mesh.rest[vertex];
    if (kind == Kind::kEdge) return lerp(mesh.rest[a], mesh.rest[b], fraction);
    return place_of(mesh, point, mesh.rest.raw());
  }
};

}  // namespace kerf
