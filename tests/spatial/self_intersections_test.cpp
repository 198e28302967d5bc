#include "kerf/spatial/self_intersections.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "kerf/base/parallel.h"
#include "kerf/base/random.h"

namespace kerf::self_intersections_test {
namespace {

// Pairs counted one by one: all triangles of two balls that overlap.
TEST(SelfIntersections, AgreeWithBruteForce) {
  const auto ball = [](Vec3 at) {
    TriangleMesh m;
    constexpr int kRings = 8, kAround = 12;
    for (int i = 0; i <= kRings; ++i)
      for (int k = 0; k < kAround; ++k) {
        const double down = 0.1 + 2.9 * i / kRings, round = 0.3 + 2 * 3.14159 * k / kAround;
        m.positions.push_back(at + Vec3{std::sin(down) * std::cos(round), 0.1 * std::cos(round) - std::cos(down),
                                        std::sin(down) * std::sin(round)});
      }
    for (int i = 0; i < kRings; ++i)
      for (int k = 0; k < kAround; ++k) {
        const VertexId a(i * kAround + k), b(i * kAround + (k + 1) % kAround), c(a.value + kAround),
            d(b.value + kAround);
        m.triangles.push_back({a, c, d});
        m.triangles.push_back({a, d, b});
      }
    return m;
  };
  TriangleMesh two = ball({});
  const TriangleMesh other = ball({0.7, 0.31, 0.2});
  const std::size_t half = two.triangles.size();
  const auto offset = static_cast<std::int32_t>(two.positions.size());
  for (const Vec3 p : other.positions) two.positions.push_back(p);
  for (const auto& t : other.triangles)
    two.triangles.push_back(
        {VertexId(offset + t[0].value), VertexId(offset + t[1].value), VertexId(offset + t[2].value)});
  const auto hits = [&](const std::array<VertexId, 3>& s, const std::array<VertexId, 3>& t) {
    const Vec3 a = two.positions[t[0]], b = two.positions[t[1]], c = two.positions[t[2]], n = cross(b - a, c - a);
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 p = two.positions[s[k]], q = two.positions[s[(k + 1) % 3]];
      const double dp = dot(n, p - a), dq = dot(n, q - a);
      if (dp * dq >= 0) continue;
      const Vec3 x = lerp(p, q, dp / (dp - dq));
      if (dot(n, cross(b - a, x - a)) > 0 && dot(n, cross(c - b, x - b)) > 0 && dot(n, cross(a - c, x - c)) > 0)
        return true;
    }
    return false;
  };
  std::size_t expected = 0;
  for (std::size_t i = 0; i < half; ++i)
    for (std::size_t j = half; j < two.triangles.size(); ++j)
      expected +=
          hits(two.triangles.raw()[i], two.triangles.raw()[j]) || hits(two.triangles.raw()[j], two.triangles.raw()[i]);
  EXPECT_GT(expected, 10u);
  EXPECT_EQ(find_self_intersections(two).pairs, expected);
}

// Two even grids that cross: every edge of one meets the other at its edges and diagonals only.
TEST(SelfIntersections, GridsThatMeetAtTheirEdges) {
  TriangleMesh grids;
  const auto add = [&](const std::function<Vec3(double, double)>& at) {
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) {
        const std::array<Vec3, 4> corner = {at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)};
        const auto first = static_cast<std::int32_t>(grids.positions.size());
        for (const Vec3 p : corner) grids.positions.push_back(p);
        grids.triangles.push_back({VertexId(first), VertexId(first + 1), VertexId(first + 2)});
        grids.triangles.push_back({VertexId(first), VertexId(first + 2), VertexId(first + 3)});
      }
  };
  add([](double i, double j) { return Vec3{i, j, 0}; });
  EXPECT_EQ(find_self_intersections(grids).pairs, 0u);
  add([](double i, double j) { return Vec3{2.5, j, i - 2.5}; });
  EXPECT_GE(find_self_intersections(grids).pairs, 4u);
}

// Whole numbers tell which triangles of a flat grid with spikes meet: there most corners lie in the planes of most others.
TEST(SelfIntersections, SpikesOnAFlatGridAgreeWithWholeNumbers) {
  constexpr int kSide = 14;
  using Point = std::array<std::int64_t, 3>;
  Random random(3);
  std::vector<Point> points;
  for (int j = 0; j <= kSide; ++j)
    for (int i = 0; i <= kSide; ++i) {
      Point p{10 * i, 10 * j, 0};
      if (random.uniform() < 0.15)
        for (std::int64_t& x : p) x += random.index(101) - 50;
      points.push_back(p);
    }
  TriangleMesh grid;
  for (const Point& p : points)
    grid.positions.push_back({static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])});
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i) {
      const VertexId a(j * (kSide + 1) + i), b(a.value + 1), c(a.value + kSide + 1), d(c.value + 1);
      grid.triangles.push_back({a, b, d});
      grid.triangles.push_back({a, d, c});
    }
  const auto side = [&](VertexId a, VertexId b, VertexId c, VertexId d) {
    std::int64_t u[3], v[3], w[3];
    for (std::size_t k = 0; k < 3; ++k) {
      u[k] = points[b.index()][k] - points[a.index()][k];
      v[k] = points[c.index()][k] - points[a.index()][k];
      w[k] = points[d.index()][k] - points[a.index()][k];
    }
    const std::int64_t volume =
        (u[1] * v[2] - u[2] * v[1]) * w[0] + (u[2] * v[0] - u[0] * v[2]) * w[1] + (u[0] * v[1] - u[1] * v[0]) * w[2];
    return volume > 0 ? 1 : volume < 0 ? -1 : 0;
  };
  const auto pierces = [&](const std::array<VertexId, 3>& s, const std::array<VertexId, 3>& t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const VertexId p = s[k], q = s[(k + 1) % 3];
      if (side(t[0], t[1], t[2], p) * side(t[0], t[1], t[2], q) >= 0) continue;
      const int a = side(p, q, t[0], t[1]), b = side(p, q, t[1], t[2]), c = side(p, q, t[2], t[0]);
      if ((a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0)) return true;
    }
    return false;
  };
  const auto& triangles = grid.triangles.raw();
  std::size_t expected = 0;
  for (std::size_t i = 0; i < triangles.size(); ++i)
    for (std::size_t j = i + 1; j < triangles.size(); ++j) {
      const auto &s = triangles[i], &t = triangles[j];
      if (std::find_first_of(s.begin(), s.end(), t.begin(), t.end()) != s.end()) continue;
      expected += pierces(s, t) || pierces(t, s);
    }
  EXPECT_GT(expected, 30u);
  EXPECT_EQ(find_self_intersections(grid).pairs, expected);
}

// A blade of a windmill that is turned through the one beside it: both hang on one corner.
TEST(SelfIntersections, NeighboursCountWhenTheyAreAskedFor) {
  TriangleMesh fan;
  for (const Vec3 p : {Vec3{0, 0, 0}, Vec3{4, 0, 0}, Vec3{0, 4, 0}, Vec3{1, 1, 0.25}, Vec3{1, 1, -1}})
    fan.positions.push_back(p);
  fan.triangles.push_back({VertexId(0), VertexId(1), VertexId(2)});
  fan.triangles.push_back({VertexId(0), VertexId(3), VertexId(4)});
  EXPECT_EQ(find_self_intersections(fan).pairs, 0u);
  const SelfIntersections found = find_self_intersections(fan, Neighbours::kCount);
  EXPECT_EQ(found.pairs, 1u);
  EXPECT_NEAR(found.deepest, 0.25, 1e-12);
  // Folded along the edge that they share, or touching: no crossing.
  fan.triangles.raw()[1] = {VertexId(0), VertexId(1), VertexId(3)};
  EXPECT_EQ(find_self_intersections(fan, Neighbours::kCount).pairs, 0u);
}

/// Triangles anywhere within a unit box, no two with a corner in common.
TriangleMesh litter(std::size_t triangles, double size) {
  TriangleMesh m;
  Random random(7);
  const auto in_box = [&] { return Vec3{random.uniform(), random.uniform(), random.uniform()}; };
  for (std::size_t t = 0; t < triangles; ++t) {
    const Vec3 at = in_box();
    std::array<VertexId, 3> corners;
    for (VertexId& v : corners) v = m.positions.push_back(at + size * in_box());
    m.triangles.push_back(corners);
  }
  return m;
}

TEST(SelfIntersections, LimitsThatAreNotMetChangeNothing) {
  const TriangleMesh m = litter(3000, 0.1);
  const SelfIntersections all = find_self_intersections(m);
  ASSERT_GT(all.pairs, 100u);
  const auto limited = find_self_intersections(m, SearchLimits{});
  ASSERT_TRUE(limited.ok());
  EXPECT_TRUE(limited->complete);
  EXPECT_EQ(limited->pairs, all.pairs);
  EXPECT_EQ(limited->deepest, all.deepest);
  EXPECT_EQ(limited->deepest_pair, all.deepest_pair);
  EXPECT_EQ(limited->places, all.places);
  EXPECT_EQ(limited->triangles, all.triangles);
}

TEST(SelfIntersections, LimitsEndTheSearchAtOnePlaceForAnyThreads) {
  const TriangleMesh m = litter(5000, 0.5);
  const std::size_t all = find_self_intersections(m).pairs;
  SearchLimits few_pairs, few_tests;
  few_pairs.pairs = all / 3;
  few_tests.tests = 100000;
  for (const SearchLimits& limits : {few_pairs, few_tests}) {
    const auto found = find_self_intersections(m, limits);
    ASSERT_TRUE(found.ok());
    EXPECT_FALSE(found->complete);
    EXPECT_GT(found->pairs, 0u);
    EXPECT_LT(found->pairs, all);
    const ThreadLimit one(1);
    const auto alone = find_self_intersections(m, limits);
    ASSERT_TRUE(alone.ok());
    EXPECT_EQ(alone->pairs, found->pairs);
    EXPECT_EQ(alone->triangles, found->triangles);
  }
}

TEST(SelfIntersections, ASampleCountsWhatItsTrianglesMeet) {
  const TriangleMesh m = litter(1000, 0.3);
  const SelfIntersections all = find_self_intersections(m);
  auto sample = sample_crossings(m, 5000, {});  // all of them: each pair is met from both sides
  ASSERT_TRUE(sample.ok());
  EXPECT_EQ(sample->crossings, 2 * all.pairs);
  EXPECT_EQ(sample->triangles, all.triangles);
  sample = sample_crossings(m, 250, {});
  ASSERT_TRUE(sample.ok());
  EXPECT_NEAR(static_cast<double>(sample->crossings), 0.25 * 2 * static_cast<double>(all.pairs),
              0.1 * static_cast<double>(all.pairs));
  SearchLimits enough;
  enough.pairs = 40;
  sample = sample_crossings(m, 250, enough);
  ASSERT_TRUE(sample.ok());
  EXPECT_EQ(sample->crossings, 40u);
}

TEST(SelfIntersections, AreAskedToStop) {
  const TriangleMesh m = litter(5000, 0.5);
  int asked = 0;
  SearchLimits limits;
  limits.progress = Progress([&](std::string_view, double) { return ++asked < 3; });
  EXPECT_FALSE(find_self_intersections(m, limits).ok());
  EXPECT_EQ(asked, 3);
  asked = 0;
  EXPECT_FALSE(sample_crossings(m, 100, limits).ok());
  EXPECT_EQ(asked, 3);
}

}  // namespace
}  // namespace kerf::self_intersections_test
