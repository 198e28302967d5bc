// Small bodies and cuts for the tests of lattice and embedding: grids, bent and jittered, cut along edges.
#pragma once

#include <cmath>
#include <functional>
#include <vector>

#include "kerf/base/random.h"
#include "kerf/binding/collision_mesh_build.h"

namespace kerf {

/// nx x ny quads over [0, lx] x [0, ly], two triangles each, moved by `place`.
inline CollisionMesh grid_body(int nx, int ny, double lx, double ly, double thickness,
                               const std::function<Vec3(Vec3)>& place = {}) {
  TriangleMesh surface;
  for (int j = 0; j <= ny; ++j)
    for (int i = 0; i <= nx; ++i) {
      const Vec3 p{lx * i / nx, ly * j / ny, 0};
      surface.positions.push_back(place ? place(p) : p);
    }
  auto id = [&](int i, int j) { return VertexId(j * (nx + 1) + i); };
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      if ((i + j) % 2 == 0) {
        surface.triangles.push_back({id(i, j), id(i + 1, j), id(i + 1, j + 1)});
        surface.triangles.push_back({id(i, j), id(i + 1, j + 1), id(i, j + 1)});
      } else {
        surface.triangles.push_back({id(i, j), id(i + 1, j), id(i, j + 1)});
        surface.triangles.push_back({id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)});
      }
    }
  const std::vector<double> half(surface.positions.size(), 0.5 * thickness);
  auto mesh = build_collision_mesh(surface, half);
  return std::move(mesh).value();
}

}  // namespace kerf
