#include "kerf/base/rotation.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "kerf/base/random.h"

#include "support/rotation_about.h"

namespace kerf::rotation_test {
namespace {

Eigen::Matrix3d eigen(const Mat3& m) {
  Eigen::Matrix3d out;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) out(i, j) = m.c[j][i];
  return out;
}
Mat3 mat3(const Eigen::Matrix3d& m) {
  Mat3 out;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) out.c[j][i] = m(i, j);
  return out;
}
Eigen::Matrix3d polar(const Eigen::Matrix3d& f) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(f, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  if ((u * svd.matrixV().transpose()).determinant() < 0) u.col(2) *= -1;
  return u * svd.matrixV().transpose();
}

TEST(Rotation, ConvergesToTheFactorOfTheSvd) {
  Random random(2);
  for (int round = 0; round < 500; ++round) {
    Eigen::Matrix3d f;
    for (int i = 0; i < 9; ++i) f(i / 3, i % 3) = (i % 4 == 0 ? 1 : 0) + random.uniform(-0.35, 0.35);
    const Mat3 turn = testing_support::rotation_about(
        {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)}, random.uniform(0, 3));
    f = eigen(turn) * f;
    if (f.determinant() < 0.1) continue;
    const Mat3 r = followed_rotation(mat3(f), {}, 20);  // cold start
    EXPECT_LT((eigen(r) - polar(f)).norm(), 1e-12) << round;
  }
}

TEST(Rotation, TwoIterationsFollowASmallTurn) {
  Random random(5);
  for (const auto& [angle, tolerance] : {std::pair(0.1, 1e-10), std::pair(0.5, 1e-4)})
    for (int round = 0; round < 50; ++round) {
      const Vec3 axis{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
      Eigen::Matrix3d stretch = Eigen::Matrix3d::Identity();
      for (int i = 0; i < 3; ++i) stretch(i, i) = random.uniform(0.8, 1.3);
      const Mat3 turn = testing_support::rotation_about(axis, angle);
      const Mat3 r = followed_rotation(mat3(eigen(turn) * stretch), {});
      EXPECT_LT((eigen(r) - eigen(turn)).norm(), tolerance);
    }
}

TEST(Rotation, StaysARotationThroughInversionAndNothing) {
  Random random(9);
  Mat3 r;
  for (int round = 0; round < 2000; ++round) {
    Eigen::Matrix3d f;
    for (int i = 0; i < 9; ++i) f(i / 3, i % 3) = random.uniform(-2, 2);
    if (round % 7 == 0) f.setZero();
    if (round % 11 == 0) f.row(1) = f.row(0);
    r = followed_rotation(mat3(f), r);
    ASSERT_LT((eigen(r).transpose() * eigen(r) - Eigen::Matrix3d::Identity()).norm(), 1e-13) << round;
    ASSERT_GT(eigen(r).determinant(), 0) << round;
  }
}

TEST(Rotation, FourLanesGiveTheBitsOfOne) {
  Random random(6);
  double f[4][3][3], r[4][3][3];
  Lanes fl[3][3], rl[3][3];
  for (int lane = 0; lane < 4; ++lane) {
    const Mat3 start = testing_support::rotation_about({1, lane + 0.5, -1}, 0.7 * lane);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        f[lane][i][j] = random.uniform(-1, 1);
        r[lane][i][j] = start.c[j][i];
        fl[i][j][lane] = f[lane][i][j];
        rl[i][j][lane] = r[lane][i][j];
      }
  }
  improve_rotation(fl, rl);
  orthonormalise(rl);
  for (int lane = 0; lane < 4; ++lane) {
    improve_rotation(f[lane], r[lane]);
    orthonormalise(r[lane]);
    for (int i = 0; i < 9; ++i) EXPECT_EQ(rl[i / 3][i % 3][lane], r[lane][i / 3][i % 3]);
  }
}

}  // namespace
}  // namespace kerf::rotation_test
