#include "kerf/binding/split_surface.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kerf/base/random.h"
#include "kerf/mesh/models.h"

namespace kerf::split_surface_test {
namespace {

using Triangles = std::vector<std::array<std::int32_t, 3>>;

/// Every triangle's normal, weighted by its angle at the vertex.
std::vector<Vec3> reference_normals(const std::vector<Vec3>& positions, const Triangles& triangles) {
  std::vector<Vec3> sum(positions.size());
  for (const auto& t : triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const auto at = [&](std::size_t k) { return positions[static_cast<std::size_t>(t[(i + k) % 3])]; };
      const Vec3 u = at(1) - at(0), v = at(2) - at(0);
      sum[static_cast<std::size_t>(t[i])] += std::atan2(norm(cross(u, v)), dot(u, v)) * normalized(cross(u, v));
    }
  for (Vec3& n : sum) n = normalized(n);
  return sum;
}

void expect_normals(const std::vector<Vec3>& positions, const Triangles& triangles, const char* what) {
  const auto expected = reference_normals(positions, triangles);
  const auto normals = smooth_normals(positions, triangles);
  ASSERT_EQ(normals.size(), expected.size());
  for (std::size_t v = 0; v < normals.size(); ++v)
    EXPECT_LT(norm(to_double(normals[v]) - expected[v]), 3e-7) << what << " " << v;
}

TEST(SplitSurface, NormalsAreWeightedByAngles) {
  for (const auto* name : {"steak", "closed-sheet"}) {
    const auto model = make_model(name, {});
    ASSERT_TRUE(model.ok());
    Triangles triangles;
    for (const auto& t : model->visual.triangles) triangles.push_back({t[0].value, t[1].value, t[2].value});
    expect_normals(model->visual.positions.raw(), triangles, name);
  }
}

// Roofs: two triangles at an edge, their angles at its ends from nearly 0 to nearly 180 degrees, right angles among them.
TEST(SplitSurface, NormalsOfThinTriangles) {
  Random random(4);
  for (int round = 0; round < 500; ++round) {
    const double far = std::pow(10.0, random.uniform(-5, 5)), near = std::pow(10.0, random.uniform(-5, 5));
    const double x = round % 5 == 0 ? 0 : random.uniform(-2, 3), y = round % 7 == 0 ? 1 : random.uniform(-2, 3);
    expect_normals({{0, 0, 0}, {1, 0, 0}, {x, near, 0.3 * near}, {y, -far, 0.5 * far}}, {{0, 1, 2}, {1, 0, 3}}, "roof");
  }
}

}  // namespace
}  // namespace kerf::split_surface_test
