// Signs against 128-bit whole numbers on near-degenerate grids, and against themselves under exact maps.
#include "kerf/spatial/predicates.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "kerf/base/random.h"

namespace kerf::predicates_test {
namespace {

__extension__ typedef __int128 Int;
int sign(Int x) { return x > 0 ? 1 : x < 0 ? -1 : 0; }

using Point = std::array<std::int64_t, 3>;
int brute2(Point a, Point b, Point c) {
  return sign(Int(a[0] - c[0]) * (b[1] - c[1]) - Int(a[1] - c[1]) * (b[0] - c[0]));
}
int brute3(Point a, Point b, Point c, Point d) {
  Int m[3][3];
  for (std::size_t k = 0; k < 3; ++k) m[0][k] = b[k] - a[k], m[1][k] = c[k] - a[k], m[2][k] = d[k] - a[k];
  return sign(m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
              m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]));
}
Vec2 flat(Point p, double scale) { return {scale * double(p[0]), scale * double(p[1])}; }
Vec3 solid(Point p, double scale) { return {scale * double(p[0]), scale * double(p[1]), scale * double(p[2])}; }

TEST(Predicates, Orient2dOnAGridOfRoundingErrors) {
  // The classic picture: points one unit of the last place apart, near the line through two far ones.
  int counts[3] = {0, 0, 0};
  for (std::int64_t i = 0; i < 64; ++i)
    for (std::int64_t j = 0; j < 64; ++j) {
      const std::int64_t one = std::int64_t{1} << 52;  // coordinates are multiples of 2^-53
      const Point p{one + i, one + j, 0}, q{24 * one, 24 * one, 0}, r{48 * one, 48 * one, 0};
      const double ulp = 0x1p-53;
      const int s = brute2(p, q, r);
      EXPECT_EQ(orient2d(flat(p, ulp), flat(q, ulp), flat(r, ulp)), s);
      EXPECT_EQ(exact::orient2d(flat(p, ulp), flat(q, ulp), flat(r, ulp)), s);
      ++counts[s + 1];
    }
  EXPECT_EQ(counts[1], 64);
  EXPECT_EQ(counts[0], counts[2]);
}

TEST(Predicates, RandomNearDegenerateAtAllScales) {
  Random random(3);
  int zeros = 0;
  for (int round = 0; round < 20000; ++round) {
    const auto range = std::int64_t{1} << (1 + random.index(38));
    const auto draw = [&] {
      Point p;
      for (auto& x : p) x = std::int64_t(random.uniform(-1, 1) * double(range));
      return p;
    };
    Point a = draw(), b = draw(), c = draw(), d = draw();
    // d = a + whole combination of the two directions, sometimes off by one.
    const int i = random.index(5) - 2, j = random.index(5) - 2;
    for (std::size_t k = 0; k < 3; ++k) d[k] = a[k] + i * (b[k] - a[k]) + j * (c[k] - a[k]);
    if (random.index(2) == 0) d[std::size_t(random.index(3))] += random.index(3) - 1;
    Point e;
    for (std::size_t k = 0; k < 3; ++k) e[k] = a[k] + i * (b[k] - a[k]) + (random.index(4) == 0 ? 1 : 0);
    const double scale = std::ldexp(1.0, random.index(600) - 300);
    EXPECT_EQ(orient3d(solid(a, scale), solid(b, scale), solid(c, scale), solid(d, scale)), brute3(a, b, c, d));
    EXPECT_EQ(exact::orient3d(solid(a, scale), solid(b, scale), solid(c, scale), solid(d, scale)), brute3(a, b, c, d));
    EXPECT_EQ(orient2d(flat(a, scale), flat(b, scale), flat(e, scale)), brute2(a, b, e));
    zeros += brute3(a, b, c, d) == 0;
  }
  EXPECT_GT(zeros, 5000);
}

TEST(Predicates, ExtremeMagnitudes) {
  const double big = std::numeric_limits<double>::max(), tiny = std::numeric_limits<double>::denorm_min();
  EXPECT_EQ(orient2d({-big, -big}, {big, big}, {0, 0}), 0);
  EXPECT_EQ(orient2d({-big, -big}, {big, big}, {0, tiny}), 1);
  EXPECT_EQ(orient2d({-big, -big}, {big, big}, {tiny, 0}), -1);
  EXPECT_EQ(orient2d({0, 0}, {tiny, 0}, {0, tiny}), 1);
  EXPECT_EQ(orient2d({tiny, tiny}, {2 * tiny, 2 * tiny}, {3 * tiny, 3 * tiny}), 0);
  EXPECT_EQ(orient3d({0, 0, 0}, {tiny, 0, 0}, {0, tiny, 0}, {0, 0, tiny}), 1);
  EXPECT_EQ(orient3d({0, 0, 0}, {tiny, 0, 0}, {0, tiny, 0}, {big, big, 0}), 0);
  EXPECT_EQ(orient3d({-big, 0, 0}, {big, -big, 0}, {big, big, 0}, {big, 0, tiny}), 1);
  EXPECT_EQ(orient3d({-big, 0, 0}, {big, -big, 0}, {big, big, 0}, {big, 0, -tiny}), -1);
  EXPECT_EQ(orient3d({big, big, 1}, {-big, big, 1}, {-big, -big, 1}, {0, 0, std::nextafter(1.0, 2.0)}), 1);
}

TEST(Predicates, AntisymmetricForAnyBits) {
  Random random(4);
  const auto draw = [&] {
    for (;;) {
      const double x = std::ldexp(random.uniform(-1, 1), random.index(2000) - 1000);
      if (std::isfinite(x)) return x;
    }
  };
  for (int round = 0; round < 5000; ++round) {
    Vec3 p[4];
    for (Vec3& q : p) q = {draw(), draw(), draw()};
    const int s = orient3d(p[0], p[1], p[2], p[3]);
    EXPECT_EQ(orient3d(p[1], p[0], p[2], p[3]), -s);
    EXPECT_EQ(orient3d(p[1], p[2], p[0], p[3]), s);
    EXPECT_EQ(orient3d(p[0], p[1], p[3], p[2]), -s);
    EXPECT_EQ(exact::orient3d(p[0], p[1], p[2], p[3]), s);
    const Vec2 a{p[0].x, p[0].y}, b{p[1].x, p[1].y}, c{p[2].x, p[2].y};
    EXPECT_EQ(orient2d(a, b, c), exact::orient2d(a, b, c));
    EXPECT_EQ(orient2d(a, b, c), -orient2d(b, a, c));
  }
}

}  // namespace
}  // namespace kerf::predicates_test
