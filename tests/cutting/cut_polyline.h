// A cut along a polyline at rest: a blade that stands on the mid-surface, led from point to point.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "kerf/base/indexed.h"
#include "kerf/cutting/blade_sweep.h"
#include "kerf/spatial/triangle_queries.h"

namespace kerf::testing_support {

/// Of the mid-surface at rest.
struct SurfacePoint {
  CollisionTriangle face;
  Vec3 point, normal;
};
inline SurfacePoint nearest_on_surface(const CollisionMesh& mesh, Vec3 p) {
  SurfacePoint best;
  double nearest = HUGE_VAL;
  for (const CollisionTriangle f : ids<CollisionTriangle>(mesh.face_count())) {
    const auto corner = [&](int i) { return mesh.rest[mesh.from(CollisionMesh::corner(f, i))]; };
    ClosestPoint there;
    closest_point(p, {corner(0), corner(1), corner(2)}, there);
    if (!(there.distance < nearest)) continue;
    nearest = there.distance;
    best = {f, there.point, normalized(cross(corner(1) - corner(0), corner(2) - corner(0)))};
  }
  return best;
}

struct PolylineCut {
  int opened_edges = 0;
  int refused = 0;
  CollisionVertex tip;  ///< where the path ends inside the body; none if it ends outside
};

/// Points in metres, at least two; each is moved onto the mid-surface along its normal, and so are points half an edge apart between them.
inline PolylineCut cut_polyline(CellComplex& body, std::span<const Vec3> points, const CutOptions& options,
                                CutScratch& scratch) {
  std::vector<Vec3> position = body.collision.rest.raw();
  FaceBoxes boxes;
  SweepTarget target{body, position, boxes, scratch, options};
  BladeStroke stroke;
  SweepReport report;
  const double edge = body.mean_root_edge;
  std::vector<BladeEdge> edges;  // beforehand: on the whole surface
  const auto stand_at = [&](Vec3 p) {
    const SurfacePoint on = nearest_on_surface(body.collision, p);
    const Vec3 at = p - dot(p - on.point, on.normal) * on.normal;
    edges.push_back({at + edge * on.normal, at - edge * on.normal});
  };
  stand_at(points[0]);
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    const int parts = std::max(1, static_cast<int>(std::ceil(norm(points[i + 1] - points[i]) / (0.5 * edge))));
    for (int k = 1; k <= parts; ++k) stand_at(lerp(points[i], points[i + 1], static_cast<double>(k) / parts));
  }
  for (const BladeEdge& e : edges) report += lead_blade(stroke, e, target);
  report += make_ends(stroke, target);
  const CollisionVertex tip = stroke.fronts.empty() ? CollisionVertex{} : stroke.fronts[0];
  return {report.steps, report.refused, tip};
}

}  // namespace kerf::testing_support
