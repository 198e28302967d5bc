// One body beside one part of a shape: what the tests of features share.
#pragma once

#include <algorithm>
#include <cmath>

#include "kerf/contact/detect_scratch.h"
#include "kerf/spatial/segment_queries.h"

namespace kerf {

struct NearShape {
  DetectRun& run;
  const BodyView& body;
  const ShapeRef& shape;
  std::int32_t part;
  const PlacedPart& placed;
  double shape_travel;  ///< the most that any of its points moves in the step, m

  /// How much of a gap can still matter at a vertex, m.
  [[nodiscard]] double approach(CollisionVertex v) const {
    return run.margin + kApproach * (body.frame.travel[v.index()] + shape_travel);
  }
  /// How far from the mid-surface at a vertex something can be and still matter, m.
  [[nodiscard]] double reach(CollisionVertex v) const { return body.frame.thickness[v.index()] + approach(v); }
  [[nodiscard]] double reach(const std::array<CollisionVertex, 3>& v) const {
    return std::max({reach(v[0]), reach(v[1]), reach(v[2])});
  }
};

/// A vertex of the body and the nearest place on the part.
void hand_out_vertex_contact(const NearShape& near, CollisionVertex v, Proximity proximity);
/// Notes a face (coarse) that a point of the shape comes within `reach` of, to be decided on by hand_out_points.
void offer_point(const NearShape& near, CollisionTriangle f, const std::array<Vec3, 3>& corner, double reach,
                 const ShapePoint& point);
/// Hands out what was noted, and forgets it.
void hand_out_points(const NearShape& near);
/// Hands out a contact of an edge of the body with an edge of the shape, if one at these feet can be.
void hand_out_edges(const NearShape& near, CollisionHalfEdge h, const ShapeEdge& edge, const SegmentFeet& feet);

/// Vertices, and where the body is coarse corners and edges, of a mesh.
void detect_mesh(const NearShape& near, double reach);
/// The same for all other parts.
void detect_simple(const NearShape& near, double reach);

}  // namespace kerf
