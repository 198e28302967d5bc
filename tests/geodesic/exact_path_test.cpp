// Exact paths against CGAL and closed forms; local paths against exact ones; both among walls.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "kerf/base/random.h"
#include "kerf/geodesic/path_scratch.h"
#include "kerf/geodesic/validate_path.h"
#include "shortest_path_oracle.h"
#include "surfaces.h"

namespace kerf {
namespace {

double bump(Vec3 p, double size) {
  return size * (std::sin(7 * p.x + 1) * std::cos(5 * p.y) + 0.5 * std::sin(11 * p.y + 13 * p.z) + 0.3 * std::cos(17 * p.x));
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
  const auto sector_of = [&](std::int32_t h) -> Sector {
    const auto passable = [&](std::int32_t e) { return m.opposite(e) >= 0 && m.wall[std::size_t(e)] == 0; };
    Sector sector{h, h};
    while (passable(sector.first)) {
      sector.first = rotate_cw(m, sector.first);
      if (sector.first == h) return {};
    }
    while (passable(WalledSurface::prev(sector.last))) sector.last = rotate_ccw(m, sector.last);
    return sector;
  };
  std::vector<std::int32_t> corner(cut.position.size(), -1);
  for (std::int32_t h = 0; h < std::int32_t(m.origin.size()); ++h) corner[std::size_t(cut.vertex[std::size_t(h)])] = h;
  for (int k = 0; k < sources; ++k) {
    const std::int32_t s = random.index(int(cut.position.size()));
    const std::int32_t hs = corner[std::size_t(s)];
    const auto distances = test::exact_distances(m, cut, s);
    for (std::size_t t = std::size_t(random.index(stride)); t < corner.size(); t += std::size_t(stride)) {
      const std::int32_t ht = corner[t], vs = m.from(hs), vt = m.from(ht);
      if (vs == vt) continue;
      const Sector at_s = sector_of(hs), at_t = sector_of(ht);
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
      ++result.pairs;
      result.worst_exact = std::max(result.worst_exact, std::fabs(exact->length / distances[t] - 1));
      result.worst_local = std::max(result.worst_local, local->length / exact->length - 1);
      result.sum_local += local->length / exact->length - 1;
      EXPECT_GE(local->length, distances[t] * (1 - 1e-9));
      EXPECT_NEAR(exact->length / distances[t], 1, 1e-9)
          << "from " << vs << " to " << vt << ": local " << local->length << " exact " << exact->length << " oracle "
          << distances[t];
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

}  // namespace
}  // namespace kerf
