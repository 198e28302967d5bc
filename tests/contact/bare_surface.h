// Surfaces without a visual mesh, and states of them, for tests of detection.
#pragma once

#include <gtest/gtest.h>

#include <vector>

#include "kerf/binding/collision_mesh_build.h"
#include "kerf/contact/detect.h"
#include "support/synthetic_complex.h"

namespace kerf::testing_support {

/// A surface with positions, offsets along the normals of the moment, and velocities.
struct BareSurface {
  CollisionMesh mesh;
  ContactSurface surface;
  std::vector<Vec3> position, offset, predicted;

  BareSurface(const TriangleMesh& triangles, std::vector<double> half_thickness) {
    auto built = build_collision_mesh(triangles, half_thickness);
    EXPECT_TRUE(built.ok());
    mesh = std::move(*built);
    surface = make_contact_surface(mesh);
    rest();
  }
  BareSurface(const TriangleMesh& triangles, double half_thickness)
      : BareSurface(triangles, std::vector<double>(triangles.positions.size(), half_thickness)) {}
  void rest() {
    position = surface.rest.raw();
    offset = surface.offset.raw();
    predicted = position;
  }
  /// Moves every vertex; offsets follow the area-weighted normals of the new shape.
  template <class Fn>
  void deform(Fn&& f) {
    for (std::size_t v = 0; v < position.size(); ++v) position[v] = f(surface.rest.raw()[v]);
    std::vector<Vec3> normal(position.size());
    for (std::size_t t = 0; t < surface.face_count(); ++t) {
      const auto c = surface.vertices(CollisionTriangle(t));
      const Vec3 n =
          cross(position[c[1].index()] - position[c[0].index()], position[c[2].index()] - position[c[0].index()]);
      for (const CollisionVertex v : c) normal[v.index()] += n;
    }
    for (std::size_t v = 0; v < position.size(); ++v) offset[v] = surface.radius.raw()[v] * normalized(normal[v]);
    predicted = position;
  }
  void move(Vec3 by) {
    for (Vec3& p : predicted) p += by;
  }
  [[nodiscard]] SurfaceState state() const { return {&surface, position, offset, predicted}; }
  [[nodiscard]] Vec3 point(const kerf::SurfacePoint& p) const {
    Vec3 sum;
    for (std::size_t i = 0; i < 3; ++i)
      if (p.vertex[i].valid())
        sum += p.weight[i] * (position[p.vertex[i].index()] + p.lift * offset[p.vertex[i].index()]);
    return sum;
  }
};

/// Two plates that never hung together, the second one 1 m above the first at rest.
inline TriangleMesh two_plates(int cells) {
  TriangleMesh mesh = plain_grid_mesh(cells, cells);
  const TriangleMesh other = mesh;
  const std::size_t first = mesh.positions.size();
  for (const Vec3 p : other.positions.raw()) mesh.positions.push_back(p + Vec3{0, 0, 1});
  for (const std::array<VertexId, 3>& t : other.triangles.raw())
    mesh.triangles.push_back(
        {VertexId(t[0].index() + first), VertexId(t[1].index() + first), VertexId(t[2].index() + first)});
  return mesh;
}

/// Only walls that cuts have left are looked at: all borders, then.
inline void count_as_cut(ContactSurface& s) {
  for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(s.twin.size())) s.cut[h] = s.twin[h].valid() ? 0 : 1;
}

}  // namespace kerf::testing_support
