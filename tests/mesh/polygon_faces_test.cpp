// Faces of many corners, against their areas.
#include "kerf/mesh/polygon_faces.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "kerf/mesh/mesh_file.h"

namespace kerf::polygon_faces_test {
namespace {

using Polygon = std::vector<Vec3>;

double area_of(Vec3 a, Vec3 b, Vec3 c, Vec3 normal) { return 0.5 * dot(cross(b - a, c - a), normal); }

/// All triangles turn as the polygon does, every corner is in one, and their areas add up: so they cover it once.
void expect_covered(const Polygon& p, Vec3 normal) {
  double whole = 0, sum = 0;
  for (std::size_t i = 2; i < p.size(); ++i) whole += area_of(p[0], p[i - 1], p[i], normal);
  const auto triangles = triangulate_polygon(p).corners;
  ASSERT_EQ(triangles.size() + 2, p.size());
  std::vector<char> used(p.size(), 0);
  for (const auto& t : triangles) {
    const auto corner = [&](int k) { return p[static_cast<std::size_t>(t[static_cast<std::size_t>(k)])]; };
    const double area = area_of(corner(0), corner(1), corner(2), normal);
    EXPECT_GE(area, -1e-12 * whole);
    sum += area;
    for (const std::int32_t i : t) used[static_cast<std::size_t>(i)] = 1;
  }
  EXPECT_NEAR(sum, whole, 1e-9 * whole);
  EXPECT_EQ(std::count(used.begin(), used.end(), 0), 0);
}

/// In the plane z = 0, turned to the left, and in some other plane, from every corner on, both ways round.
void expect_covered_anyhow(const std::vector<Vec2>& flat) {
  const Vec3 x = normalized(Vec3{1, 2, -0.5}), z = normalized(cross(x, Vec3{0.3, -1, 2})), y = cross(z, x);
  Polygon p;
  for (const Vec2 q : flat) p.push_back(Vec3{3, -1, 2} + q.x * x + q.y * y);
  for (std::size_t i = 0; i < p.size(); ++i) {
    expect_covered(p, z);
    std::rotate(p.begin(), p.begin() + 1, p.end());
  }
  std::reverse(p.begin(), p.end());
  expect_covered(p, -z);
}

std::vector<Vec2> star(int tips, double inner) {
  std::vector<Vec2> p;
  for (int i = 0; i < 2 * tips; ++i) {
    const double r = i % 2 == 0 ? 1 : inner, angle = std::numbers::pi * i / tips;
    p.push_back({r * std::cos(angle), r * std::sin(angle)});
  }
  return p;
}

std::vector<Vec2> comb(int teeth) {
  std::vector<Vec2> p{{0, 0}, {2.0 * teeth, 0}};
  for (int i = teeth; i > 0; --i)
    for (const Vec2 q : {Vec2{2.0 * i, 3}, Vec2{2.0 * i - 1, 3}, Vec2{2.0 * i - 1, 1}, Vec2{2.0 * i - 2, 1}})
      p.push_back(q);
  return p;
}

TEST(PolygonFaces, AreCoveredOnce) {
  expect_covered_anyhow({{0, 0}, {1, 0}, {1, 1}, {0, 1}});
  expect_covered_anyhow({{0, 0}, {2, 0}, {0.5, 0.5}, {0, 2}});                              // an arrow's head
  expect_covered_anyhow({{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}});                  // L
  expect_covered_anyhow({{0, 0}, {1, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}, {0, 1}});  // corners on straight sides
  expect_covered_anyhow({{0, 0}, {3, 0}, {3, 2}, {2, 2}, {2, 1}, {1, 1}, {1, 2}, {0, 2}});  // U
  expect_covered_anyhow(star(12, 0.4));
  expect_covered_anyhow(star(5, 0.1));
  expect_covered_anyhow(comb(7));
  // A square with a square hole, joined by a cut that is passed twice.
  expect_covered_anyhow({{0, 0}, {3, 0}, {3, 3}, {0, 3}, {0, 0}, {1, 1}, {1, 2}, {2, 2}, {2, 1}, {1, 1}});
}

TEST(PolygonFaces, OfRandomCornersAreCoveredOnce) {
  std::mt19937 random(7);
  const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
  for (int trial = 0; trial < 300; ++trial) {
    const int n = 4 + static_cast<int>(random() % 60);
    std::vector<Vec2> p;  // seen from the origin its corners come one after another
    for (int i = 0; i < n; ++i) {
      const double angle = 2 * std::numbers::pi * (i + 0.9 * uniform()) / n, r = 0.05 + uniform();
      p.push_back({r * std::cos(angle), r * std::sin(angle)});
    }
    Polygon flat;
    for (const Vec2 q : p) flat.push_back({q.x, q.y, 0});
    expect_covered(flat, {0, 0, 1});
  }
}

TEST(PolygonFaces, OfManyCornersAreCoveredOnce) {
  Polygon flat;
  for (const Vec2 q : star(5000, 0.9)) flat.push_back({q.x, q.y, 0});
  expect_covered(flat, {0, 0, 1});
}

// All its gaps lie in one line beside its back, so every ear of that is beside all of them.
TEST(PolygonFaces, AreGivenUpAfterAWhile) {
  std::string obj;
  const std::vector<Vec2> corners = comb(50000);
  for (const Vec2 q : corners) obj += fmt::format("v {} {} 0\n", q.x, q.y);
  obj += "f";
  for (std::size_t i = 0; i < corners.size(); ++i) obj += fmt::format(" {}", i + 1);
  const auto read = parse_obj(obj, "comb.obj");
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(
      read.error().message,
      "comb.obj:200003: a face with 200002 corners is not convex, and takes too long to be divided; export the mesh with triangles");
}

TEST(PolygonFaces, ThatAreNotSimpleHaveTheirTrianglesOrNone) {
  std::mt19937 random(11);
  for (int trial = 0; trial < 1000; ++trial) {
    Polygon p;
    for (int i = 4 + static_cast<int>(random() % 8); i > 0; --i)
      p.push_back({static_cast<double>(random() % 4), static_cast<double>(random() % 4), 0});
    const PolygonTriangles found = triangulate_polygon(p);
    EXPECT_FALSE(found.too_long);
    EXPECT_TRUE(found.corners.empty() || found.corners.size() + 2 == p.size());
  }
}

// A plate like an arrow's head, its caps of four corners: the fan from the first corner would lie outside.
TEST(PolygonFaces, OfFilesAreDivided) {
  const std::string obj =
      "v 2 0 0\nv 0.5 0.5 0\nv 0 2 0\nv 0 0 0\nvt 0.2 0\nvt 0.05 0.05\nvt 0 0.2\nvt 0 0\nf 1/1 2/2 3/3 4/4\n";
  const std::string off = "OFF\n4 1 0\n2 0 0\n0.5 0.5 0\n0 2 0\n0 0 0\n4 0 1 2 3\n";
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n2 0 0\n0.5 0.5 0\n0 2 0\n0 0 0\n4 0 1 2 3\n";
  for (const auto& read : {parse_obj(obj, "plate.obj"), parse_off(off, "plate.off"), parse_ply(ply, "plate.ply")}) {
    ASSERT_TRUE(read.ok()) << read.error().message;
    const TriangleMesh& mesh = read.value();
    double area = 0;
    for (const auto& t : mesh.triangles)
      area += norm(cross(mesh.positions[t[1]] - mesh.positions[t[0]], mesh.positions[t[2]] - mesh.positions[t[0]])) / 2;
    EXPECT_NEAR(area, 1, 1e-6);
    for (const TriangleId t : ids<TriangleId>(mesh.texture.size()))
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_NEAR(10 * mesh.texture[t][k].x, mesh.positions[mesh.triangles[t][k]].x, 1e-6);
  }
}

}  // namespace
}  // namespace kerf::polygon_faces_test
