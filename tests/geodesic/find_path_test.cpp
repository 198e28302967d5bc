// find_path: local paths on surfaces whose geodesics are known, walls, sectors, and surfaces that change between calls.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kerf/base/random.h"
#include "kerf/geodesic/path_scratch.h"
#include "kerf/geodesic/validate_path.h"
#include "surfaces.h"

namespace kerf {
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
  const double r = 0.5, facet = 2 * r * std::sin(kPi / n) * n / (2 * kPi);  // radius whose circle is the polygon's length
  const auto m = grid(n, n, [&](double u, double v) {
    return Vec3{r * std::cos(2 * kPi * u), r * std::sin(2 * kPi * u), 2 * v};
  }, true);
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

}  // namespace
}  // namespace kerf
