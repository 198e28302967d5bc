// One square in four faces, so that every place of a path is known beforehand.
//
//   2 ------- 3
//   | \     / |
//   |   \ /   |
//   |    4    |
//   |   / \   |
//   | /     \ |
//   0 ------- 1
//
// 1 m wide; mean root edge 0.854 m, minimum feature 0.0205 m.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "cutting/cut_body.h"
#include "kerf/cutting/rest_point.h"

namespace kerf::testing_support {

struct FourFaces : CutBody {
  explicit FourFaces(bool closed) : CutBody(grid_mesh(1, 1, 1, 1, [](int, int) { return true; }), sizes(closed)) {
    options.flips = false;
    feature = options.minimum_feature * body.mean_root_edge;
    position = body.collision.rest.raw();
  }
  /// The face that holds (x, y): below, left, right or above the middle.
  [[nodiscard]] CollisionTriangle face(double x, double y) const {
    for (std::int32_t f = 0; f < static_cast<std::int32_t>(body.collision.face_count()); ++f)
      if (const auto w = weights(CollisionTriangle(f), x, y); std::min({w[0], w[1], w[2]}) >= -1e-12)
        return CollisionTriangle(f);
    ADD_FAILURE() << "no face holds " << x << ", " << y;
    return {};
  }
  [[nodiscard]] std::array<double, 3> weights(CollisionTriangle f, double x, double y) const {
    const CollisionMesh& m = body.collision;
    const auto p = [&](int k) { return m.rest[m.from(CollisionMesh::corner(f, k))]; };
    const auto area = [](Vec3 a, Vec3 b, Vec3 c) { return cross(b - a, c - a).z; };
    const Vec3 q{x, y, 0};
    const double sum = area(p(0), p(1), p(2));
    return {area(q, p(1), p(2)) / sum, area(p(0), q, p(2)) / sum, area(p(0), p(1), q) / sum};
  }
  [[nodiscard]] FacePoint face_point(double x, double y) const {
    const CollisionTriangle f = face(x, y);
    return {f, weights(f, x, y)};
  }
  [[nodiscard]] RestPoint point(double x, double y) const { return rest_point(body.collision, face_point(x, y)); }
  [[nodiscard]] Vec3 place(CollisionVertex v) const { return body.collision.rest[v]; }

  double feature = 0;  ///< metres
  std::vector<Vec3> position;
  FaceBoxes boxes;

 private:
  static SyntheticOptions sizes(bool closed) {
    SyntheticOptions o;
    o.closed = closed;
    o.subdivisions = 4;
    return o;
  }
};

}  // namespace kerf::testing_support
