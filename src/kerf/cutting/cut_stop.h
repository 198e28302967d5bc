// What a path is cut along: vertices, and points where one is to be made.
#pragma once

#include "kerf/cutting/rest_point.h"

namespace kerf {

/// A point of a path.
struct CutStop {
  enum class Kind { kNone, kVertex, kBorder, kEdge, kInside };
  Kind kind = Kind::kNone;
  CollisionVertex vertex;   ///< kVertex
  CollisionVertex a, b;     ///< kBorder: at `fraction` of the border edge a - b
  CollisionHalfEdge edge;   ///< kEdge: at `fraction` of an inner edge
  double fraction = 0;
  RestPoint point;      ///< kInside

  static CutStop at_vertex(CollisionVertex v) { return {Kind::kVertex, v, {}, {}, {}, 0, {}}; }
  static CutStop on_border(CollisionVertex a, CollisionVertex b, double fraction) { return {Kind::kBorder, {}, a, b, {}, fraction, {}}; }
  static CutStop on_edge(CollisionHalfEdge h, double fraction) { return {Kind::kEdge, {}, {}, {}, h, fraction, {}}; }
  static CutStop inside(const RestPoint& p) { return {Kind::kInside, {}, {}, {}, {}, 0, p}; }

  [[nodiscard]] bool exists() const { return kind != Kind::kNone; }
  /// A border edge at it: its own, or the one that leaves its vertex; none inside the material.
  [[nodiscard]] CollisionHalfEdge border(const CollisionMesh& mesh) const {
    if (kind == Kind::kBorder) return mesh.find_half_edge(a, b);
    const CollisionHalfEdge h = kind == Kind::kVertex ? mesh.fan_start(vertex) : CollisionHalfEdge{};
    return h.valid() && mesh.is_border(h) ? h : CollisionHalfEdge{};
  }
  /// At rest, metres.
  [[nodiscard]] Vec3 place(const CollisionMesh& mesh) const {
    if (kind == Kind::kVertex) return mesh.rest[vertex];
    if (kind == Kind::kBorder) return lerp(mesh.rest[a], mesh.rest[b], fraction);
    if (kind == Kind::kEdge) return lerp(mesh.rest[mesh.from(edge)], mesh.rest[mesh.to(edge)], fraction);
    return place_of(mesh, point, mesh.rest.raw());
  }
};

}  // namespace kerf
