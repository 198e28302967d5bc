#include "kerf/lattice/prism.h"

#include <gtest/gtest.h>

#include "kerf/base/random.h"
#include "kerf/lattice/hex_mesh.h"
#include "lattice/lattice_bodies.h"

namespace kerf::prism_test {
namespace {

/// Integral of x^n over [a, b], halved (so that over [-1, 1] it is the mean).
double power_integral(double a, double b, int n) { return (std::pow(b, n + 1) - std::pow(a, n + 1)) / (2 * (n + 1)); }

TEST(Prism, MomentsOfABoxInsideACellAreExact) {
  // One cell from -1 to 1; a jittered grid over a box in it falls into prisms of all shapes.
  Random random(3);
  const double x0 = -0.7, x1 = 0.9, y0 = -1, y1 = 0.35, z0 = -0.5, z1 = 0.8;
  auto place = [&](Vec3 p) {
    const bool inner = p.x > 1e-9 && p.x < 1 - 1e-9 && p.y > 1e-9 && p.y < 1 - 1e-9;
    if (inner) p.x += random.uniform(-.1, .1), p.y += random.uniform(-.1, .1);
    return Vec3{x0 + p.x * (x1 - x0), y0 + p.y * (y1 - y0), 0.5 * (z0 + z1)};
  };
  CollisionMesh mesh = grid_body(3, 3, 1, 1, z1 - z0, place);
  LatticeFrame frame;
  frame.origin = {-1, -1, -1};
  frame.cell = {2, 2, 2};
  frame.count = {1, 1, 1};
  for (const bool leaning : {false, true}) {
    if (leaning)  // inner verticals lean: the same box, prisms with twisted walls
      for (const CollisionVertex v : ids<CollisionVertex>(mesh.vertex_count()))
        if (!mesh.on_border(v)) mesh.offset.set(v, mesh.offset[v] + Vec3{0.05, -0.08, 0});
    Moments moments{};
    for (const CollisionTriangle t : ids<CollisionTriangle>(mesh.face_count())) {
      PrismCorners corner[3];
      for (int i = 0; i < 3; ++i) corner[i] = corners_of(mesh, frame, mesh.origin[CollisionMesh::corner(t, i)]);
      add_prism_moments(prism_between(corner[0], corner[1], corner[2]), {0, 0, 0}, moments);
    }
    const std::array<double, 27> weights = weights_of(moments);
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        for (int c = 0; c < 3; ++c) {
          double sum = 0;
          for (std::size_t q = 0; q < 27; ++q) {
            const Vec3 p = quadrature_points()[q];
            sum += weights[q] * std::pow(p.x, a) * std::pow(p.y, b) * std::pow(p.z, c);
          }
          EXPECT_NEAR(sum, power_integral(x0, x1, a) * power_integral(y0, y1, b) * power_integral(z0, z1, c), 1e-14)
              << a << b << c;
        }
  }
}

TEST(Prism, UprightPrismsHaveTheMomentsOfSlantedOnesInTheLimit) {
  // A prism that leans by 1e-9 goes through the general path, an upright one through the short cut.
  Random random(5);
  int there = 0, not_there = 0;
  for (int i = 0; i < 60; ++i) {
    Prism upright, leaning;
    const int axis = i % 3;
    for (std::size_t k = 0; k < 3; ++k) {
      Vec3 p{random.uniform(-1, 2), random.uniform(-1, 2), random.uniform(-1, 2)};
      p[axis] = 0.2;
      upright.minus[k] = upright.plus[k] = p;
      upright.plus[k][axis] = 1.3;
      leaning = upright;
    }
    for (Vec3& p : leaning.plus) p[(axis + 1) % 3] += 1e-9;
    const Vec3 point{random.uniform(), random.uniform(), random.uniform()};
    Vec3 normal{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    normal[axis] = 0;
    normal = normalized(normal);
    for (const LatticeIndex cell :
         {LatticeIndex{0, 0, 0}, LatticeIndex{1, 0, 0}, LatticeIndex{0, 1, 1}, LatticeIndex{-1, 0, 1}}) {
      Moments a{}, b{}, left_a{}, left_b{}, right_a{}, right_b{};
      add_prism_moments(upright, cell, a);
      add_prism_moments(leaning, cell, b);
      add_prism_moments_beside(upright, cell, point, normal, left_a, right_a);
      add_prism_moments_beside(leaning, cell, point, normal, left_b, right_b);
      for (std::size_t m = 0; m < 27; ++m) {
        EXPECT_NEAR(a[m], b[m], 1e-8);
        EXPECT_NEAR(left_a[m], left_b[m], 1e-8);
        EXPECT_NEAR(right_a[m], right_b[m], 1e-8);
        EXPECT_NEAR(left_a[m] + right_a[m], a[m], 1e-14);
      }
      for (const int side : {1, -1}) {
        const bool beside = (side > 0 ? left_a : right_a)[0] > 1e-8;
        EXPECT_EQ(prism_beside(upright, cell, point, normal, side), beside);
        EXPECT_EQ(prism_beside(leaning, cell, point, normal, side), beside);
        ++(beside ? there : not_there);
      }
    }
  }
  EXPECT_GT(there, 50);
  EXPECT_GT(not_there, 50);
}

TEST(Prism, PartsInTheCellsAddUpToTheWhole) {
  Random random(9);
  LatticeFrame frame;
  frame.count = {12, 12, 12};
  for (int i = 0; i < 300; ++i) {
    const double size = i % 3 == 0 ? 8 : 1.5;
    Prism p;
    const Vec3 base{random.uniform(1, 3), random.uniform(1, 3), random.uniform(1, 3)};
    for (std::size_t k = 0; k < 3; ++k) {
      const double angle = 2.1 * static_cast<double>(k) + random.uniform(0, 0.9);
      p.minus[k] =
          base + Vec3{size / 2 * (1 + std::cos(angle)), size / 2 * (1 + std::sin(angle)), random.uniform(0, 0.3)};
      p.plus[k] = p.minus[k] + Vec3{random.uniform(-.2, .2), random.uniform(-.2, .2), random.uniform(0.4, 1)};
    }
    auto tet = [](Vec3 a, Vec3 b, Vec3 c, Vec3 d) { return std::fabs(dot(cross(b - a, c - a), d - a)) / 6; };
    const double whole = tet(p.minus[0], p.minus[1], p.minus[2], p.plus[2]) +
                         tet(p.minus[0], p.minus[1], p.plus[1], p.plus[2]) +
                         tet(p.minus[0], p.plus[0], p.plus[1], p.plus[2]);
    std::vector<double> scratch;
    std::vector<CellVolume> cells;
    prism_in_cells(p, frame, scratch, cells);
    double sum = 0;
    for (const CellVolume& c : cells) {
      sum += c.volume;
      EXPECT_NEAR(prism_in_cell(p, c.cell), c.volume, 1e-12);
      Moments whole_moments{}, left{}, right{};
      add_prism_moments(p, c.cell, whole_moments);
      EXPECT_NEAR(whole_moments[0], c.volume, 1e-12);
      add_prism_moments_beside(p, c.cell, base + Vec3{size / 2, size / 2, 0}, normalized({1, -0.3, 0.1}), left, right);
      for (std::size_t m = 0; m < 27; ++m) EXPECT_NEAR(left[m] + right[m], whole_moments[m], 1e-12);
    }
    EXPECT_NEAR(sum, whole, 1e-11 * whole + 1e-11);
  }
}

TEST(Prism, RuledVolumeAddsUpWhenATwistedTriangleIsSplit) {
  Random random(4);
  for (int i = 0; i < 100; ++i) {
    PrismCorners c[3];
    for (int k = 0; k < 3; ++k) {
      const Vec3 p{2.0 * (k == 1), 1.5 * (k == 2), 0.1 * k},
          o{random.uniform(-.3, .3), random.uniform(-.3, .3), random.uniform(0.2, 1)};
      c[k] = {p - o, p + o, CollisionVertex(k)};
    }
    const double t = random.uniform(0.1, 0.9);
    const PrismCorners m{lerp(c[0].minus, c[1].minus, t), lerp(c[0].plus, c[1].plus, t), CollisionVertex(7)};
    const double whole = ruled_volume(prism_between(c[0], c[1], c[2]));
    EXPECT_NEAR(ruled_volume(prism_between(c[0], m, c[2])) + ruled_volume(prism_between(m, c[1], c[2])), whole, 1e-14);
  }
}

}  // namespace
}  // namespace kerf::prism_test
