// Rows that stand for the points of a held border.
#include "kerf/session/held_material.h"

#include <gtest/gtest.h>

#include "kerf/base/random.h"
#include "kerf/embedding/embedding.h"

namespace kerf::border_rows_test {
namespace {

using Points = std::vector<std::pair<std::array<double, 8>, double>>;

/// Nine points of a plane across a cell and their shares.
Points points_of_plane(Random& random) {
  Points points;
  const double at = random.uniform(-1, 1);
  for (int i = 0; i < 9; ++i)
    points.emplace_back(trilinear_weights({at, random.uniform(-1, 1), random.uniform(-1, 1)}), random.uniform(0.1, 1));
  return points;
}

TEST(BorderRows, HoldAsThePointsDo) {
  Random random(20261130);
  for (int k = 0; k < 100; ++k) {
    Points points = points_of_plane(random);
    if (k % 2 != 0)
      for (const auto& more : points_of_plane(random)) points.push_back(more);
    const std::vector<BorderRow> rows = border_rows(points);
    EXPECT_LE(rows.size(), k % 2 != 0 ? 8 : 4);
    for (int n = 0; n < 20; ++n) {
      std::array<double, 8> u;
      for (double& x : u) x = random.uniform(-1, 1);
      double wanted = 0, got = 0;
      for (const auto& [w, share] : points) {
        double moved = 0;
        for (std::size_t c = 0; c < 8; ++c) moved += w[c] * u[c];
        wanted += share * moved * moved;
      }
      for (const BorderRow& row : rows) {
        double moved = 0;
        for (std::size_t c = 0; c < 8; ++c) moved += row.weights[c] * u[c];
        got += moved * moved;
      }
      EXPECT_NEAR(got, wanted, 1e-8 * wanted);
    }
  }
}

TEST(BorderRows, OfNoPointsAreNone) { EXPECT_TRUE(border_rows({}).empty()); }

}  // namespace
}  // namespace kerf::border_rows_test
