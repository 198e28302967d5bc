// Exact paths against CGAL and closed forms; local paths against exact ones; both among walls.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "kerf/base/random.h"
#include "kerf/geodesic/path_scratch.h"
#include "kerf/geodesic/validate_path.h"
#include "shortest_path_oracle.h"
#include "surfaces.h"

namespace kerf::exact_path_test {
namespace {

double bump(Vec3 p, double size) {
  return size *
         (std::sin(7 * p.x + 1) * std::cos(5 * p.y) + 0.5 * std::sin(11 * p.y + 13 * p.z) + 0.3 * std::cos(17 * p.x));
}

struct Comparison {
  int pairs = 0;
  double worst_exact = 0, worst_local = 0, sum_local = 0;
};

// From `sources` random corners to all others: lengths, validity, order of local, exact and the oracle.
Comparison compare(const WalledSurface& m, int sources, int stride, std::uint64_t seed) {
  const test::CutOpen cut(m);
  Random random(seed);
  PathScratch scratch;
  Comparison result;
  std::vector<std::int32_t> corner(cut.position.size(), -1);
  for (std::int32_t h = 0; h < std::int32_t(m.origin.size()); ++h) corner[std::size_t(cut.vertex[std::size_t(h)])] = h;
  for (int k = 0; k < sources; ++k) {
    const std::int32_t s = random.index(int(cut.position.size()));
    const std::int32_t hs = corner[std::size_t(s)];
    const auto distances = test::exact_distances(m, cut, s);
    for (std::size_t t = std::size_t(random.index(stride)); t < corner.size(); t += std::size_t(stride)) {
      const std::int32_t ht = corner[t], vs = m.from(hs), vt = m.from(ht);
      if (vs == vt) continue;
      const Sector at_s = test::sector_of(m, hs), at_t = test::sector_of(m, ht);
      const PathQuery query(m, vs, vt, at_s, at_t);
      const auto local = find_path(m, vs, vt, at_s, at_t, {false}, scratch);
      const auto exact = find_path(m, vs, vt, at_s, at_t, {true}, scratch);
      EXPECT_EQ(local.ok(), distances[t] >= 0);
      EXPECT_EQ(exact.ok(), distances[t] >= 0);
      if (!local.ok() || !exact.ok() || distances[t] < 0) continue;
      for (const SurfacePath* path : {&*local, &*exact}) {
        const Status valid = validate_path(query, *path);
        EXPECT_TRUE(valid.ok()) << valid.error().message;
        EXPECT_LE(path->length, test::polyline_length(m, *path) * (1 + 1e-9));
      }
      EXPECT_TRUE(exact->exact);
      EXPECT_FALSE(local->exact);
      ++result.pairs;
      result.worst_exact = std::max(result.worst_exact, std::fabs(exact->length / distances[t] - 1));
      result.worst_local = std::max(result.worst_local, local->length / exact->length - 1);
      result.sum_local += local->length / exact->length - 1;
      EXPECT_GE(local->length, distances[t] * (1 - 1e-9));
      EXPECT_NEAR(exact->length / distances[t], 1, 1e-9) << "from " << vs << " to " << vt << ": local " << local->length
                                                         << " exact " << exact->length << " oracle " << distances[t];
    }
  }
  return result;
}

TEST(ExactPath, BumpySheetAgreesWithOracle) {
  Random random(1);
  const auto m = test::grid(20, 20, [&](double u, double v) {
    const Vec3 p{u + 0.01 * random.uniform(-1, 1), v + 0.01 * random.uniform(-1, 1), 0};
    return Vec3{p.x, p.y, bump(p, 0.05)};
  });
  const Comparison c = compare(m, 6, 2, 1);
  EXPECT_GT(c.pairs, 1000);
  EXPECT_LT(c.worst_local, 0.01);
}

TEST(ExactPath, BumpyBallAgreesWithOracle) {
  const auto m = test::ball(9, [](Vec3 d) { return 1 + bump(d, 0.15); });
  const Comparison c = compare(m, 8, 2, 2);
  EXPECT_GT(c.pairs, 1000);
  EXPECT_LT(c.worst_local, 0.12);
}

// Random paths, each inserted as a wall that starts and ends anywhere, on other walls too.
void add_random_walls(WalledSurface& m, int count, std::uint64_t seed) {
  Random random(seed);
  PathScratch scratch;
  for (int k = 0; k < count; ++k) {
    const std::int32_t hs = random.index(int(m.origin.size())), ht = random.index(int(m.origin.size()));
    const std::int32_t s = m.from(hs), t = m.from(ht);
    if (s == t) continue;
    const Sector at_s = test::sector_of(m, hs), at_t = test::sector_of(m, ht);
    const auto path = find_path(m, s, t, at_s, at_t, {k % 2 == 0}, scratch);
    if (!path.ok()) continue;
    const Status valid = validate_path(PathQuery(m, s, t, at_s, at_t), *path);
    ASSERT_TRUE(valid.ok()) << valid.error().message;
    test::insert_path(m, *path, 0.3);
    if (testing::Test::HasFatalFailure()) return;
    test::check_manifold(m);
    if (testing::Test::HasFatalFailure()) return;
  }
}

TEST(ExactPath, AmongWallsAgreesWithOracleOnTheCutSurface) {
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    Random random(seed);
    auto m = seed % 2 == 0
                 ? test::grid(12, 12,
                              [&](double u, double v) {
                                const Vec3 p{u + 0.02 * random.uniform(-1, 1), v + 0.02 * random.uniform(-1, 1), 0};
                                return Vec3{p.x, p.y, bump(p, seed == 0 ? 0 : 0.06)};
                              })
                 : test::ball(6, [](Vec3 d) { return 1 + bump(d, 0.1); });
    add_random_walls(m, seed < 4 ? 6 : 25, 50 + seed);
    if (HasFatalFailure()) return;
    const Comparison c = compare(m, 3, 3, 70 + seed);
    EXPECT_GT(c.pairs, 150);
  }
}

TEST(ExactPath, ConeAlsoPastItsSaddle) {
  // A cone of total angle 1.5 turns (a saddle) or 0.7 turns around vertex 0.
  for (const double turns : {0.7, 1.5}) {
    const int n = 36, rings = 6;
    std::vector<Vec3> p{{0, 0, 0}};
    test::Triangles t;
    // Turns below one: a round cone; above: a wave of the same length.
    const double lift = turns < 1 ? std::sqrt(1 - turns * turns) : 0;
    for (int r = 1; r <= rings; ++r)
      for (int i = 0; i < n; ++i) {
        const double a = 2 * std::numbers::pi * i / n, radius = double(r) / rings;
        const double z = turns < 1 ? lift : 0.9 * std::cos(3 * a);
        const Vec3 d =
            normalized(Vec3{(turns < 1 ? turns : 1) * std::cos(a), (turns < 1 ? turns : 1) * std::sin(a), z});
        p.push_back(radius * d);
      }
    const auto id = [&](int r, int i) { return 1 + (r - 1) * n + (i % n); };
    for (int i = 0; i < n; ++i) {
      t.push_back({0, id(1, i), id(1, i + 1)});
      for (int r = 1; r < rings; ++r) {
        t.push_back({id(r, i), id(r + 1, i), id(r + 1, i + 1)});
        t.push_back({id(r, i), id(r + 1, i + 1), id(r, i + 1)});
      }
    }
    const auto m = test::make_surface(std::move(p), t);
    // Every ring sector is flat, so the surface is an exact cone whose angle is the sum of the sectors'.
    std::vector<double> angle(std::size_t(n) + 1, 0);
    for (int i = 0; i < n; ++i) {
      const Vec3 a = m.at(id(1, i)), b = m.at(id(1, i + 1));
      angle[std::size_t(i) + 1] = angle[std::size_t(i)] + std::atan2(norm(cross(a, b)), dot(a, b));
    }
    const double total = angle.back();
    EXPECT_EQ(total > 2 * std::numbers::pi, turns > 1);
    PathScratch scratch;
    int through = 0;
    for (int i = 0; i < n; i += 5)
      for (int j = i + 1; j < n; ++j)
        for (const bool exact : {false, true}) {
          const std::int32_t s = id(3, i), e = id(5, j);
          const double ra = 3.0 / rings, rb = 5.0 / rings, away = angle[std::size_t(j)] - angle[std::size_t(i)];
          const double between = std::min(away, total - away);
          const double closed =
              between >= std::numbers::pi ? ra + rb : std::sqrt(ra * ra + rb * rb - 2 * ra * rb * std::cos(between));
          const auto path = find_path(m, s, e, {}, {}, {exact}, scratch);
          ASSERT_TRUE(path.ok());
          const Status valid = validate_path(PathQuery(m, s, e, {}, {}), *path);
          EXPECT_TRUE(valid.ok()) << valid.error().message;
          if (exact) {
            EXPECT_NEAR(path->length, closed, 1e-12);
            // The straight chords of the ring lie a little inside the cone, never shorter.
            for (const PathStop& stop : path->stops) through += stop.vertex == 0;
          } else {
            EXPECT_GE(path->length, closed - 1e-12);
          }
        }
    if (turns > 1) EXPECT_GT(through, 20);
    else EXPECT_EQ(through, 0);
  }
}

TEST(ExactPath, CubeAcrossItsFaces) {
  // Sides of 4 x 4 quads. Opposite corners: sqrt(5) edges; centres of opposite sides: 2 edges.
  const int n = 4;
  std::vector<Vec3> p;
  test::Triangles t;
  const auto vertex = [&](Vec3 q) {
    for (std::size_t i = 0; i < p.size(); ++i)
      if (p[i] == q) return int(i);
    p.push_back(q);
    return int(p.size()) - 1;
  };
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side)
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          const auto at = [&](int a, int b) {
            Vec3 q;
            q[axis] = side;
            q[(axis + 1) % 3] = double(side == 1 ? a : b) / n;
            q[(axis + 2) % 3] = double(side == 1 ? b : a) / n;
            return vertex(q);
          };
          t.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
          t.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
  const auto m = test::make_surface(std::move(p), t);
  PathScratch scratch;
  const auto length = [&](Vec3 a, Vec3 b) {
    const auto path = find_path(m, test::nearest_vertex(m, a), test::nearest_vertex(m, b), {}, {}, {true}, scratch);
    return path.ok() ? path->length : -1;
  };
  EXPECT_NEAR(length({0, 0, 0}, {1, 1, 1}), std::sqrt(5.0), 1e-14);
  EXPECT_NEAR(length({0.5, 0.5, 0}, {0.5, 0.5, 1}), 2, 1e-14);
  EXPECT_NEAR(length({0, 0, 0}, {1, 0, 1}), std::sqrt(2.0), 1e-14);
  EXPECT_NEAR(length({0, 0.25, 0.25}, {1, 0.75, 0.75}), std::sqrt(4.25), 1e-14);  // over one side only
}

TEST(ExactPath, SphereConverges) {
  double last = 1;
  for (const int n : {4, 8, 16}) {
    const auto m = test::ball(n, [](Vec3) { return 1.0; });
    PathScratch scratch;
    Random random(3);
    double worst = 0;
    for (int k = 0; k < 60; ++k) {
      const std::int32_t s = random.index(int(m.position.size())), t = random.index(int(m.position.size()));
      if (s == t) continue;
      const auto path = find_path(m, s, t, {}, {}, {true}, scratch);
      ASSERT_TRUE(path.ok());
      const double arc = std::acos(std::clamp(dot(m.at(s), m.at(t)), -1.0, 1.0));
      EXPECT_LE(path->length, arc * (1 + 1e-9));  // the polyhedron lies inside
      worst = std::max(worst, 1 - path->length / arc);
    }
    EXPECT_LT(worst, 0.4 * last);
    last = worst;
  }
  EXPECT_LT(last, 0.01);
}

}  // namespace
}  // namespace kerf::exact_path_test
