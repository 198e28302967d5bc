#include "kerf/cutting/swept_deviation.h"

namespace kerf {
namespace {

/// Along no edge of a model.
constexpr Vec3 kOutwards{0.0137, 0.0071, 0.99988};

TriangleSoup triangles_of(const CellComplex& body, bool walls) {
  TriangleSoup soup;
  const VisualMesh& m = body.visual;
  for (const VisualTriangle f : ids<VisualTriangle>(m.face_count())) {
    if (m.patch[f].is_wall() != walls) continue;
    const auto at = [&](int k) { return m.rest[m.origin[VisualMesh::corner(f, k)]]; };
    soup.add(at(0), at(1), at(2));
  }
  soup.build();
  return soup;
}

}  // namespace

void TriangleSoup::add(Vec3 a, Vec3 b, Vec3 c) {
  for (const Vec3 p : {a, b, c}) {
    corners_.push_back(static_cast<std::int32_t>(points_.size()));
    points_.push_back(p);
    box_.add(p);
  }
}

void TriangleSoup::build() { tree_ = TriangleBvh(TriangleView(points_, corners_)); }

double TriangleSoup::distance(Vec3 p) const {
  return points_.empty() ? HUGE_VAL : tree_.closest(TriangleView(points_, corners_), p).distance;
}

bool TriangleSoup::encloses(Vec3 p) const {
  if (p.x < box_.min.x || p.y < box_.min.y || p.z < box_.min.z || p.x > box_.max.x || p.y > box_.max.y ||
      p.z > box_.max.z)
    return false;
  std::vector<RayHit> hits;
  tree_.all_hits(TriangleView(points_, corners_), Ray{p, kOutwards}, hits);
  return hits.size() % 2 == 1;
}

TriangleSoup skin_of(const CellComplex& body) { return triangles_of(body, false); }
TriangleSoup walls_of(const CellComplex& body) { return triangles_of(body, true); }

std::vector<TriangleSoup> each_wall_of(const CellComplex& body) {
  const VisualMesh& m = body.visual;
  std::vector<TriangleSoup> walls(body.wall_edge.size());
  for (const VisualTriangle f : ids<VisualTriangle>(m.face_count())) {
    if (!m.patch[f].is_wall()) continue;
    const auto at = [&](int k) { return m.rest[m.origin[VisualMesh::corner(f, k)]]; };
    walls[m.patch[f].wall().index()].add(at(0), at(1), at(2));
  }
  std::erase_if(walls, [](const TriangleSoup& wall) { return wall.size() == 0; });
  for (TriangleSoup& wall : walls) wall.build();
  return walls;
}

FarthestPlace stray_of(const TriangleSoup& walls, const TriangleSoup& swept, double step) {
  FarthestPlace farthest;
  walls.for_each_place(step, [&](Vec3 p) {
    if (const double far = swept.distance(p); far > farthest.distance) farthest = {far, p};
  });
  return farthest;
}

FarthestPlace missed_of(const TriangleSoup& swept, const TriangleSoup& walls, const TriangleSoup& skin, double step) {
  FarthestPlace farthest;
  swept.for_each_place(step, [&](Vec3 p) {
    if (!skin.encloses(p)) return;
    if (const double far = std::min(walls.distance(p), skin.distance(p)); far > farthest.distance) farthest = {far, p};
  });
  return farthest;
}

FarthestPlace outside_of(const TriangleSoup& walls, const TriangleSoup& skin, double step) {
  FarthestPlace farthest;
  walls.for_each_place(step, [&](Vec3 p) {
    if (skin.encloses(p)) return;
    if (const double far = skin.distance(p); far > farthest.distance) farthest = {far, p};
  });
  return farthest;
}

}  // namespace kerf
