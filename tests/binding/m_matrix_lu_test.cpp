#include "kerf/binding/m_matrix_lu.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "kerf/base/random.h"

namespace kerf {
namespace {

/// Grid graph of w x w nodes with random positive weights in both directions, rows of sum `slack` or more.
SparseRows grid_system(int w, std::uint64_t seed) {
  Random random(seed);
  SparseRows a;
  a.first.push_back(0);
  for (int i = 0; i < w * w; ++i) {
    double sum = 0;
    for (const int j : {i - w, i - 1, i + 1, i + w}) {
      const bool inside = j >= 0 && j < w * w && (j / w == i / w || j % w == i % w);
      const double weight = random.uniform(0.01, 1);
      sum += weight;
      if (!inside) continue;
      a.column.push_back(j);
      a.value.push_back(-weight);
    }
    a.first.push_back(static_cast<std::int32_t>(a.column.size()));
    a.diagonal.push_back(sum);
  }
  return a;
}

std::vector<Vec3> grid_points(int w) {
  std::vector<Vec3> points;
  for (int i = 0; i < w * w; ++i) points.push_back({static_cast<double>(i % w), static_cast<double>(i / w), 0});
  return points;
}

TEST(MMatrixLu, AgreesWithDenseLu) {
  for (const int w : {1, 2, 3, 7, 15, 26}) {  // the last is ordered by nested dissection
    const SparseRows a = grid_system(w, 11);
    const int n = w * w;
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(n, n), b(n, 2);
    Random random(2);
    std::vector<Vec2> x(static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i) {
      const auto u = static_cast<std::size_t>(i);
      dense(i, i) = a.diagonal[u];
      for (int k = a.first[u]; k < a.first[u + 1]; ++k) dense(i, a.column[static_cast<std::size_t>(k)]) = a.value[static_cast<std::size_t>(k)];
      x[u] = {random.uniform(-1, 1), random.uniform(-1, 1)};
      b(i, 0) = x[u].x;
      b(i, 1) = x[u].y;
    }
    MMatrixLu lu;
    ASSERT_TRUE(lu.factor(a, grid_points(w)));
    lu.solve(x);
    const Eigen::MatrixXd expected = dense.partialPivLu().solve(b);
    for (int i = 0; i < n; ++i) {
      EXPECT_NEAR(x[static_cast<std::size_t>(i)].x, expected(i, 0), 1e-10);
      EXPECT_NEAR(x[static_cast<std::size_t>(i)].y, expected(i, 1), 1e-10);
    }
  }
}

TEST(MMatrixLu, RefusesMatricesThatAreNoMMatrices) {
  SparseRows a;
  a.first = {0, 1, 2};
  a.column = {1, 0};
  a.value = {-2, -2};
  a.diagonal = {1, 1};
  EXPECT_FALSE(MMatrixLu().factor(a, grid_points(1)));
  a.diagonal = {1, std::numeric_limits<double>::quiet_NaN()};
  EXPECT_FALSE(MMatrixLu().factor(a, grid_points(1)));
}

}  // namespace
}  // namespace kerf
