#include "kerf/binding/m_matrix_lu.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "kerf/base/random.h"

namespace kerf::m_matrix_lu_test {
namespace {

std::size_t at(std::int32_t i) { return static_cast<std::size_t>(i); }

/// Grid graph of w x h nodes with positive weights in both directions, rows of sum 0, or more on the border.
template <class Weight>
SparseRows grid_system(int w, int h, Weight&& weight_of) {
  SparseRows a;
  a.first.push_back(0);
  for (int i = 0; i < w * h; ++i) {
    double sum = 0;
    for (const int j : {i - w, i - 1, i + 1, i + w}) {
      const bool inside = j >= 0 && j < w * h && (j / w == i / w || j % w == i % w);
      const double weight = weight_of();
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
SparseRows grid_system(int w, std::uint64_t seed) {
  Random random(seed);
  return grid_system(w, w, [&] { return random.uniform(0.01, 1); });
}

std::vector<Vec3> grid_points(int w, int h) {
  std::vector<Vec3> points;
  for (int i = 0; i < w * h; ++i) points.push_back({static_cast<double>(i % w), static_cast<double>(i / w), 0});
  return points;
}
std::vector<Vec3> grid_points(int w) { return grid_points(w, w); }

std::vector<Vec2> random_sides(std::size_t n, std::uint64_t seed) {
  Random random(seed);
  std::vector<Vec2> x(n);
  for (Vec2& v : x) v = {random.uniform(-1, 1), random.uniform(-1, 1)};
  return x;
}

/// The greatest residual of a row, relative to the sum of its terms' sizes.
double residual(const SparseRows& a, const std::vector<Vec2>& b, const std::vector<Vec2>& x) {
  double worst = 0;
  for (std::size_t i = 0; i < b.size(); ++i) {
    Vec2 rest = b[i] - a.diagonal[i] * x[i];
    double size = norm(b[i]) + a.diagonal[i] * norm(x[i]);
    for (std::int32_t k = a.first[i]; k < a.first[i + 1]; ++k) {
      rest = rest - a.value[at(k)] * x[at(a.column[at(k)])];
      size += std::fabs(a.value[at(k)]) * norm(x[at(a.column[at(k)])]);
    }
    worst = std::max(worst, norm(rest) / size);
  }
  return worst;
}

void expect_dense_solution(const SparseRows& a, const std::vector<Vec3>& points, double tolerance) {
  const auto n = static_cast<Eigen::Index>(a.diagonal.size());
  const std::vector<Vec2> sides = random_sides(a.diagonal.size(), 2);
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(n, n), b(n, 2);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto u = static_cast<std::size_t>(i);
    dense(i, i) = a.diagonal[u];
    for (int k = a.first[u]; k < a.first[u + 1]; ++k) dense(i, a.column[at(k)]) = a.value[at(k)];
    b(i, 0) = sides[u].x;
    b(i, 1) = sides[u].y;
  }
  std::vector<Vec2> x = sides;
  ASSERT_TRUE(MMatrixLu().solve(a, points, x));
  const Eigen::MatrixXd expected = dense.partialPivLu().solve(b);
  for (Eigen::Index i = 0; i < n; ++i) {
    EXPECT_NEAR(x[static_cast<std::size_t>(i)].x, expected(i, 0), tolerance);
    EXPECT_NEAR(x[static_cast<std::size_t>(i)].y, expected(i, 1), tolerance);
  }
}

TEST(MMatrixLu, AgreesWithDenseLu) {
  for (const int w : {1, 2, 3, 4, 5, 7, 11, 15, 26}) expect_dense_solution(grid_system(w, 11), grid_points(w), 1e-10);
}

TEST(MMatrixLu, AgreesWithDenseLuOnStripsAndScatteredRows) {
  Random random(3);
  for (const auto& [w, h] : {std::pair{1, 90}, {90, 1}, {2, 60}, {5, 41}})
    expect_dense_solution(grid_system(w, h, [&] { return random.uniform(0.01, 1); }), grid_points(w, h), 1e-10);
  // No neighbours at all, and parts that do not hang together.
  expect_dense_solution(
      {.first = std::vector<std::int32_t>(41, 0), .column = {}, .value = {}, .diagonal = std::vector<double>(40, 2)},
      grid_points(40, 1), 1e-15);
  SparseRows apart = grid_system(6, 5);
  const SparseRows other = grid_system(7, 6);
  for (std::size_t i = 0; i < other.diagonal.size(); ++i) {
    for (std::int32_t k = other.first[i]; k < other.first[i + 1]; ++k) {
      apart.column.push_back(other.column[at(k)] + 36);
      apart.value.push_back(other.value[at(k)]);
    }
    apart.first.push_back(static_cast<std::int32_t>(apart.column.size()));
    apart.diagonal.push_back(other.diagonal[i]);
  }
  std::vector<Vec3> points = grid_points(6);
  for (const Vec3 p : grid_points(7)) points.push_back(p + Vec3{100, 0, 0});
  expect_dense_solution(apart, points, 1e-10);
}

TEST(MMatrixLu, PointsOnlyCostTime) {
  const SparseRows a = grid_system(12, 4);
  expect_dense_solution(a, std::vector<Vec3>(144, Vec3{1, 2, 3}), 1e-10);
  std::vector<Vec3> scattered, tiny, huge, far = grid_points(12), growing;
  Random random(8);
  for (const Vec3 p : grid_points(12)) {
    scattered.push_back({random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)});
    tiny.push_back(1e-200 * p);
    huge.push_back(1e99 * p);
    growing.push_back({std::pow(2.0, 0.3 * static_cast<double>(growing.size())), 0, 0});
  }
  for (Vec3& p : far) p = 1e-9 * p + Vec3{1, -1, 1};
  for (const auto& points : {scattered, tiny, huge, far, growing}) expect_dense_solution(a, points, 1e-10);
}

TEST(MMatrixLu, LeavesNoMoreThanRoundingInLargeSystems) {
  for (const int w : {60, 130}) {
    const SparseRows a = grid_system(w, 19);
    const std::vector<Vec2> b = random_sides(a.diagonal.size(), 6);
    std::vector<Vec2> x = b;
    ASSERT_TRUE(MMatrixLu().solve(a, grid_points(w), x));
    EXPECT_LT(residual(a, b, x), 1e-14) << w;
  }
}

// Weights as triangles a million times as long as wide give them.
TEST(MMatrixLu, SolvesSystemsOfWildlyDifferentWeights) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    Random random(seed);
    const int w = 40;
    const SparseRows a = grid_system(w, w, [&] { return std::pow(10.0, random.uniform(-12, 0)); });
    const std::vector<Vec2> b = random_sides(a.diagonal.size(), seed);
    std::vector<Vec2> x = b;
    ASSERT_TRUE(MMatrixLu().solve(a, grid_points(w), x));
    EXPECT_LT(residual(a, b, x), 1e-14) << seed;
  }
}

TEST(MMatrixLu, KeepsNothingOfTheLastSystem) {
  MMatrixLu used;
  std::vector<Vec2> x = random_sides(900, 4);
  ASSERT_TRUE(used.solve(grid_system(30, 1), grid_points(30), x));
  for (const int w : {9, 2, 17}) {
    const SparseRows a = grid_system(w, 23);
    std::vector<Vec2> again = random_sides(a.diagonal.size(), 5), fresh = again;
    ASSERT_TRUE(used.solve(a, grid_points(w), again));
    ASSERT_TRUE(MMatrixLu().solve(a, grid_points(w), fresh));
    EXPECT_EQ(again, fresh);
  }
}

TEST(MMatrixLu, RefusesMatricesThatAreNoMMatrices) {
  SparseRows a;
  a.first = {0, 1, 2};
  a.column = {1, 0};
  a.value = {-2, -2};
  a.diagonal = {1, 1};
  const std::vector<Vec2> sides = random_sides(2, 1);
  std::vector<Vec2> x = sides;
  EXPECT_FALSE(MMatrixLu().solve(a, grid_points(2, 1), x));
  EXPECT_EQ(x, sides);
  a.diagonal = {1, std::numeric_limits<double>::quiet_NaN()};
  EXPECT_FALSE(MMatrixLu().solve(a, grid_points(2, 1), x));
  SparseRows singular = grid_system(20, 3);
  singular.diagonal[217] = -1;
  x = random_sides(400, 1);
  EXPECT_FALSE(MMatrixLu().solve(singular, grid_points(20), x));
}

}  // namespace
}  // namespace kerf::m_matrix_lu_test
