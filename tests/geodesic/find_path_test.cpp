// find_path: local paths on surfaces whose geodesics are known, walls, sectors, and surfaces that change between calls.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kerf/base/random.h"
#include "kerf/geodesic/path_scratch.h"
#include "kerf/geodesic/validate_path.h"
#include "surfaces.h"

namespace kerf::find_path_test {
namespace {

using test::grid;
constexpr double kPi = std::numbers::pi;

SurfacePath path_between(const WalledSurface& m, std::int32_t s, std::int32_t t, bool exact = false, Sector at_s = {},
                         Sector at_t = {}) {
  static thread_local PathScratch scratch;
  auto result = find_path(m, s, t, at_s, at_t, PathOptions{exact}, scratch);
  EXPECT_TRUE(result.ok()) << result.error().message;
  if (!result.ok()) return {};
  const Status valid = validate_path(PathQuery(m, s, t, at_s, at_t), *result);
  EXPECT_TRUE(valid.ok()) << valid.error().message;
  return *result;
}

std::pair<std::int32_t, std::int32_t> random_pair(Random& random, const WalledSurface& m) {
  const int n = int(m.position.size());
  const int s = random.index(n);
  int t = random.index(n - 1);
  if (t >= s) ++t;
  return {s, t};
}

TEST(FindPath, FlatSheetIsExact) {
  Random random(1);
  const auto m = grid(24, 20, [&](double u, double v) {
    return Vec3{u + 0.01 * random.uniform(-1, 1), v + 0.01 * random.uniform(-1, 1), 0};
  });
  for (int i = 0; i < 500; ++i) {
    const auto [s, t] = random_pair(random, m);
    if (m.wall_vertex[std::size_t(s)] != 0 || m.wall_vertex[std::size_t(t)] != 0) continue;
    const auto path = path_between(m, s, t);
    EXPECT_NEAR(path.length, norm(m.at(t) - m.at(s)), 1e-12);
    EXPECT_NEAR(test::polyline_length(m, path), path.length, 1e-9);
  }
}

TEST(FindPath, RegularGridGoesThroughVerticesOnTheLine) {
  const auto m = grid(16, 16, [](double u, double v) { return Vec3{u, v, 0}; });
  const auto id = [](int i, int j) { return j * 17 + i; };
  const auto path = path_between(m, id(2, 3), id(10, 7));  // passes (4,4), (6,5), (8,6)
  EXPECT_NEAR(path.length, norm(m.at(id(2, 3)) - m.at(id(10, 7))), 1e-14);
  for (std::int32_t v : {id(4, 4), id(6, 5), id(8, 6)})
    EXPECT_EQ(std::count_if(path.stops.begin(), path.stops.end(), [&](const PathStop& s) { return s.vertex == v; }), 1);
  const auto row = path_between(m, id(2, 3), id(10, 3));
  ASSERT_EQ(row.stops.size(), 9u);
  for (int i = 0; i < 9; ++i) EXPECT_EQ(row.stops[std::size_t(i)].vertex, id(2 + i, 3));
}

TEST(FindPath, CylinderUnrolls) {
  const int n = 48;
  const double r = 0.5,
               facet = 2 * r * std::sin(kPi / n) * n / (2 * kPi);  // radius whose circle is the polygon's length
  const auto m = grid(
      n, n,
      [&](double u, double v) {
        return Vec3{r * std::cos(2 * kPi * u), r * std::sin(2 * kPi * u), 2 * v};
      },
      true);
  Random random(2);
  for (int i = 0; i < 300; ++i) {
    const int a = random.index(n), b = 1 + random.index(n - 1), c = random.index(n), d = 1 + random.index(n - 1);
    const int around = std::min((a - c + n) % n, (c - a + n) % n);
    if (around == 0 || around > n / 2 - 2) continue;  // opposite points: two geodesics, local may take either
    const double exact = std::hypot(around * 2 * kPi * facet / n, 2.0 * (b - d) / n);
    EXPECT_NEAR(path_between(m, b * n + a, d * n + c).length, exact, 1e-12);
  }
}

TEST(FindPath, GoesRoundAWallAndFailsWhenSeparated) {
  auto m = grid(20, 20, [](double u, double v) { return Vec3{u, v, 0}; });
  const auto id = [](int i, int j) { return j * 21 + i; };
  // A wall along column 10 from row 5 to the lower border.
  test::insert_path(m, path_between(m, id(10, 5), id(10, 0)));
  test::check_manifold(m);
  const auto path = path_between(m, id(7, 2), id(13, 2));
  const double around = 2 * std::hypot(3.0, 3.0) / 20;
  EXPECT_NEAR(path.length, around, 1e-12);
  EXPECT_NEAR(test::polyline_length(m, path), around, 1e-5);
  // Extended to the other border, it separates.
  test::insert_path(m, path_between(m, id(10, 5), id(10, 20)));
  PathScratch scratch;
  const auto none = find_path(m, id(7, 2), id(13, 2), {}, {}, {}, scratch);
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.error().message.find(std::to_string(id(7, 2) + 1)), std::string::npos);
  EXPECT_NE(none.error().message.find(std::to_string(id(13, 2) + 1)), std::string::npos);
  EXPECT_FALSE(find_path(m, 5, 5, {}, {}, {}, scratch).ok());
}

TEST(FindPath, StaysInsideItsSectors) {
  auto m = grid(16, 16, [](double u, double v) { return Vec3{u, v, 0.1 * std::sin(6 * u) * std::cos(5 * v)}; });
  const auto id = [](int i, int j) { return j * 17 + i; };
  const std::int32_t s = id(8, 8);
  for (const std::int32_t t : {id(2, 8), id(14, 9), id(8, 2), id(9, 14), id(3, 3)})
    test::insert_path(m, path_between(m, s, t), 0.3);
  test::check_manifold(m);
  // Walls now divide the fan of s into five sectors; from each, every vertex can be reached around the walls' far ends.
  std::vector<Sector> sectors;
  for_each_in_sector(m, s, {}, [&](std::int32_t h) {
    const Sector sector = test::sector_of(m, h);
    if (sectors.empty() ||
        std::none_of(sectors.begin(), sectors.end(), [&](Sector k) { return k.first == sector.first; }))
      sectors.push_back(sector);
    return true;
  });
  ASSERT_EQ(sectors.size(), 5u);
  for (const bool exact : {false, true})
    for (const std::int32_t t : {id(12, 12), id(4, 12), id(12, 4), id(4, 4), id(9, 8)}) {
      double shortest = HUGE_VAL;
      for (const Sector sector : sectors) {
        const auto path = path_between(m, s, t, exact, sector);
        ASSERT_GE(path.stops.size(), 2u);
        shortest = std::min(shortest, path.length);
        // The face or edge of the first step, found without the library's own test.
        std::vector<std::int32_t> allowed;
        for (std::int32_t h = sector.first;; h = m.opposite(WalledSurface::prev(h))) {
          allowed.push_back(h / 3);
          if (h == sector.last) break;
        }
        const PathStop& stop = path.stops[1];
        bool inside = false;
        for (const std::int32_t f : allowed)
          for (std::int32_t h = 3 * f; h < 3 * f + 3; ++h)
            inside = inside || h == stop.half_edge || (stop.half_edge < 0 && m.from(h) == stop.vertex);
        EXPECT_TRUE(inside);
      }
      EXPECT_NEAR(shortest, path_between(m, s, t, exact).length, exact ? 1e-12 : 0.1 * shortest);
    }
}

TEST(FindPath, BesideAWallOnTheDirectEdge) {
  auto m = grid(8, 8, [](double u, double v) { return Vec3{u, v, 0}; });
  const std::int32_t s = 4 * 9 + 3, t = 4 * 9 + 4;
  test::insert_path(m, path_between(m, s, t));
  // Beside it, above and below in turn, then beside those.
  double last = norm(m.at(t) - m.at(s));
  for (int k = 0; k < 8; ++k) {
    const double up = k % 2 == 0 ? 1 : -1;
    const auto outermost = [&](std::int32_t v) {
      std::int32_t best = -1;
      for_each_in_sector(m, v, {}, [&](std::int32_t h) {
        if (best < 0 || up * m.at(m.to(h)).y > up * m.at(m.to(best)).y) best = h;
        return true;
      });
      return test::sector_of(m, best);
    };
    const auto path = path_between(m, s, t, k % 3 == 0, outermost(s), outermost(t));
    ASSERT_GT(path.stops.size(), 2u);
    EXPECT_GE(path.length, norm(m.at(t) - m.at(s)) - 1e-12);
    EXPECT_NEAR(path.length, last, k < 2 ? 1e-12 : 2 * last);
    for (std::size_t i = 1; i + 1 < path.stops.size(); ++i) {
      const PathStop& stop = path.stops[i];
      const std::int32_t h = stop.half_edge;
      const Vec3 p = h < 0 ? m.at(stop.vertex) : lerp(m.at(m.from(h)), m.at(m.to(h)), stop.t);
      EXPECT_GE(up * p.y, up * 0.5);
    }
    test::insert_path(m, path, 0.3);
    test::check_manifold(m);
    if (HasFatalFailure()) return;
  }
}

// Paths one after another, each inserted as a wall that later ones may not cross, on surfaces of every quality.
void run_evolving(WalledSurface m, int paths, std::uint64_t seed, bool exact) {
  Random random(seed);
  PathScratch kept;
  int inserted = 0;
  for (int k = 0; k < paths; ++k) {
    const std::int32_t hs = random.index(int(m.origin.size())), ht = random.index(int(m.origin.size()));
    const std::int32_t s = m.from(hs), t = m.from(ht);
    if (s == t) continue;
    const Sector at_s = test::sector_of(m, hs), at_t = test::sector_of(m, ht);
    const auto path = find_path(m, s, t, at_s, at_t, {exact}, kept);
    PathScratch fresh;
    const auto again = find_path(m, s, t, at_s, at_t, {exact}, fresh);
    ASSERT_EQ(path.ok(), again.ok());
    if (!path.ok()) continue;  // walls separate them
    ASSERT_EQ(path->length, again->length) << "what the scratch held before changed the result";
    ASSERT_EQ(path->stops.size(), again->stops.size());
    ASSERT_TRUE(std::isfinite(path->length));
    for (const PathStop& stop : path->stops)
      if (stop.half_edge >= 0) {
        ASSERT_EQ(m.wall[std::size_t(stop.half_edge)], 0);
        ASSERT_GE(m.opposite(stop.half_edge), 0);
        ASSERT_TRUE(stop.t > 0 && stop.t < 1);
      }
    for (std::size_t i = 1; i + 1 < path->stops.size(); ++i)
      ASSERT_TRUE(path->stops[i].half_edge >= 0 || m.wall_vertex[std::size_t(path->stops[i].vertex)] == 0);
    const Status valid = validate_path(PathQuery(m, s, t, at_s, at_t), *path);
    ASSERT_TRUE(valid.ok()) << valid.error().message;
    test::insert_path(m, *path, 0.3);
    if (testing::Test::HasFatalFailure()) return;
    ++inserted;
  }
  test::check_manifold(m);
  EXPECT_GT(inserted, paths / 4);
}

TEST(FindPath, EvolvingSurfaces) {
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    Random random(seed);
    const double rough = seed % 3 == 0 ? 0 : 0.05 * double(seed % 3);
    if (seed % 2 == 0)
      run_evolving(grid(14, 14,
                        [&](double u, double v) {
                          return Vec3{u, v, rough * random.uniform(-1, 1)};
                        }),
                   40, seed, seed % 4 == 0);
    else run_evolving(test::ball(6, [&](Vec3) { return 1 + rough * random.uniform(-1, 1); }), 40, seed, seed % 4 == 1);
    if (HasFatalFailure()) return;
  }
}

TEST(FindPath, DegenerateGeometryOnlyCostsLength) {
  for (std::uint64_t seed = 0; seed < 18; ++seed) {
    Random random(100 + seed);
    auto m = grid(12, 12, [&](double u, double v) { return Vec3{u, v, 0.05 * random.uniform(-1, 1)}; });
    for (std::size_t v = 0; v < m.position.size(); ++v) {
      Vec3& p = m.position[v];
      switch (seed % 6) {
        case 0: p.x *= 1e-9; break;                                        // needles
        case 1: p = {p.x, 0, 0}; break;                                    // everything on a line
        case 2: p = {std::floor(3 * p.x), std::floor(3 * p.y), 0}; break;  // heaps of equal vertices
        case 3: p = {}; break;                                             // a point
        case 4: p = 1e150 * p; break;
        default:
          if (random.index(3) == 0 && v > 0) p = m.position[v - 1];  // zero-length edges here and there
      }
    }
    run_evolving(std::move(m), 25, seed, seed % 2 == 0);
    if (HasFatalFailure()) return;
  }
}

}  // namespace
}  // namespace kerf::find_path_test
