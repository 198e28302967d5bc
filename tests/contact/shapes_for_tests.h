// Rigid shapes of every kind, and meshes for them.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <utility>

#include "kerf/base/random.h"
#include "kerf/contact/rigid_shape.h"

namespace kerf::testing_support {

inline TriangleMesh ball_mesh(double radius, int sectors = 12, int rings = 8) {
  const double pi = 3.14159265358979323846;
  TriangleMesh mesh;
  const VertexId top = mesh.positions.push_back({0, 0, radius});
  std::vector<VertexId> ids;
  for (int r = 1; r < rings; ++r)
    for (int s = 0; s < sectors; ++s) {
      const double a = pi * r / rings, b = 2 * pi * s / sectors;
      ids.push_back(
          mesh.positions.push_back(radius * Vec3{std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a)}));
    }
  const VertexId bottom = mesh.positions.push_back({0, 0, -radius});
  const auto at = [&](int r, int s) { return ids[static_cast<std::size_t>((r - 1) * sectors + s % sectors)]; };
  for (int s = 0; s < sectors; ++s) {
    mesh.triangles.push_back({top, at(1, s), at(1, s + 1)});
    for (int r = 1; r + 1 < rings; ++r) {
      mesh.triangles.push_back({at(r, s), at(r + 1, s), at(r + 1, s + 1)});
      mesh.triangles.push_back({at(r, s), at(r + 1, s + 1), at(r, s + 1)});
    }
    mesh.triangles.push_back({at(rings - 1, s), bottom, at(rings - 1, s + 1)});
  }
  return mesh;
}

/// Twelve triangles.
inline TriangleMesh box_mesh(Vec3 half) {
  TriangleMesh mesh;
  for (int c = 0; c < 8; ++c)
    mesh.positions.push_back(
        {(c & 1) != 0 ? half.x : -half.x, (c & 2) != 0 ? half.y : -half.y, (c & 4) != 0 ? half.z : -half.z});
  const int quads[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& q : quads) {
    mesh.triangles.push_back({VertexId(q[0]), VertexId(q[1]), VertexId(q[2])});
    mesh.triangles.push_back({VertexId(q[0]), VertexId(q[2]), VertexId(q[3])});
  }
  return mesh;
}

inline std::shared_ptr<const ObstacleMesh> prepared(const TriangleMesh& mesh) {
  auto made = make_obstacle_mesh(mesh);
  EXPECT_TRUE(made.ok());
  return std::make_shared<const ObstacleMesh>(std::move(*made));
}

inline RigidShape shape_of(ShapePart part) {
  RigidShape s;
  s.parts.push_back(std::move(part));
  s.friction = 0.3;
  return s;
}

inline Vec3 random_vector(Random& random, double size) {
  return {random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size)};
}
inline Mat3 random_rotation(Random& random) {
  const Vec3 a = normalized(random_vector(random, 1) + Vec3{0, 0, 1e-3}),
             b = normalized(cross(a, random_vector(random, 1)));
  return {{a, b, cross(a, b)}};
}

/// One shape of each kind, about `size` large, around `place`.
inline std::vector<RigidShape> one_of_each(Random& random, Vec3 place, double size) {
  std::vector<RigidShape> shapes;
  shapes.push_back(shape_of(plane_part({}, random_vector(random, 1))));
  shapes.push_back(shape_of(sphere_part(random_vector(random, 0.2 * size), size)));
  shapes.push_back(shape_of(capsule_part(random_vector(random, size), random_vector(random, size), 0.4 * size)));
  shapes.push_back(shape_of(box_part({}, {size, 0.5 * size, 0.7 * size}, random_rotation(random))));
  shapes.push_back(shape_of(box_part({}, {size, 0.3 * size, 0.1 * size}, random_rotation(random), 0.2 * size)));
  shapes.push_back(
      shape_of(mesh_part(prepared(ball_mesh(size)), random_vector(random, 0.1 * size), random_rotation(random))));
  shapes.push_back(shape_of(mesh_part(prepared(box_mesh({size, 0.6 * size, 0.3 * size})))));
  for (RigidShape& s : shapes) {
    s.position = place;
    s.axes = random_rotation(random);
  }
  return shapes;
}

}  // namespace kerf::testing_support
