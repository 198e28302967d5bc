#include "kerf/lattice/prism.h"

#include <gtest/gtest.h>

#include "kerf/base/random.h"
#include "kerf/lattice/hex_mesh.h"
#include "kerf/lattice/lattice_build.h"
#include "lattice/lattice_bodies.h"

namespace kerf {
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
  const CollisionMesh mesh = grid_body(3, 3, 1, 1, z1 - z0, place);
  LatticeFrame frame;
  frame.origin = {-1, -1, -1};
  frame.cell = {2, 2, 2};
  frame.count = {1, 1, 1};
  const auto hex = build_lattice(mesh, frame, 0);
  ASSERT_TRUE(hex.ok());
  ASSERT_EQ(hex->hex_count(), 1u);
  const auto& weights = hex->weights[HexId(0)];
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b)
      for (int c = 0; c < 3; ++c) {
        double sum = 0;
        for (std::size_t q = 0; q < 27; ++q) {
          const Vec3 p = quadrature_points()[q];
          sum += weights[q] * std::pow(p.x, a) * std::pow(p.y, b) * std::pow(p.z, c);
        }
        EXPECT_NEAR(sum, power_integral(x0, x1, a) * power_integral(y0, y1, b) * power_integral(z0, z1, c), 1e-14) << a << b << c;
      }
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
      p.minus[k] = base + Vec3{size / 2 * (1 + std::cos(angle)), size / 2 * (1 + std::sin(angle)), random.uniform(0, 0.3)};
      p.plus[k] = p.minus[k] + Vec3{random.uniform(-.2, .2), random.uniform(-.2, .2), random.uniform(0.4, 1)};
    }
    auto tet = [](Vec3 a, Vec3 b, Vec3 c, Vec3 d) { return std::fabs(dot(cross(b - a, c - a), d - a)) / 6; };
    const double whole = tet(p.minus[0], p.minus[1], p.minus[2], p.plus[2]) + tet(p.minus[0], p.minus[1], p.plus[1], p.plus[2]) +
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
      const Vec3 p{2.0 * (k == 1), 1.5 * (k == 2), 0.1 * k}, o{random.uniform(-.3, .3), random.uniform(-.3, .3), random.uniform(0.2, 1)};
      c[k] = {p - o, p + o, CollisionVertex(k)};
    }
    const double t = random.uniform(0.1, 0.9);
    const PrismCorners m{lerp(c[0].minus, c[1].minus, t), lerp(c[0].plus, c[1].plus, t), CollisionVertex(7)};
    const double whole = ruled_volume(prism_between(c[0], c[1], c[2]));
    EXPECT_NEAR(ruled_volume(prism_between(c[0], m, c[2])) + ruled_volume(prism_between(m, c[1], c[2])), whole, 1e-14);
  }
}

}  // namespace
}  // namespace kerf
