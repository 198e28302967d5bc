#include "kerf/base/rigid_place.h"

#include <gtest/gtest.h>

#include <numbers>

#include "kerf/base/random.h"

namespace kerf::rigid_place_test {
namespace {

Vec3 random_direction(Random& random) {
  for (;;) {
    const Vec3 v{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    if (norm(v) > 0.1 && norm(v) <= 1) return normalized(v);
  }
}

TEST(RigidPlace, TurnsAndTheirVectorsAreInverse) {
  Random random(1);
  for (const double angle : {1e-12, 1e-6, 0.1, 1.0, 2.0, 3.0, std::numbers::pi - 1e-9, std::numbers::pi})
    for (int i = 0; i < 50; ++i) {
      const Vec3 rotation = angle * random_direction(random);
      const Mat3 m = turn(rotation);
      EXPECT_NEAR(norm(m * rotation - rotation), 0, 1e-15 * (1 + angle));
      const Mat3 again = turn(turn_of(m));
      for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(norm(again.c[c] - m.c[c]), 0, 4e-15) << angle;
      if (angle < 3.1) {
        EXPECT_NEAR(norm(turn_of(m) - rotation), 0, 2e-15 * (1 + angle)) << angle;
      }
    }
}

TEST(RigidPlace, AQuarterTurnAboutZ) {
  const Mat3 m = turn({0, 0, std::numbers::pi / 2});
  EXPECT_NEAR(norm(m * Vec3{1, 0, 0} - Vec3{0, 1, 0}), 0, 1e-15);
  EXPECT_NEAR(norm(m * Vec3{0, 1, 0} - Vec3{-1, 0, 0}), 0, 1e-15);
}

TEST(RigidPlace, HalfWayIsHalfTheTurn) {
  const RigidPlace a{{1, 0, 0}, turn({0, 0, 0.2})}, b{{3, 0, 0}, turn({0, 0, 1.0})};
  const RigidPlace half = between(a, b, 0.5);
  EXPECT_EQ(half.position, (Vec3{2, 0, 0}));
  EXPECT_NEAR(norm(turn_of(half.axes) - Vec3{0, 0, 0.6}), 0, 1e-15);
  EXPECT_EQ(between(a, b, 0), a);
  EXPECT_EQ(between(a, b, 1), b);
  const Vec3 p{0.3, -0.2, 0.5};
  EXPECT_NEAR(norm(half.to_local(half.to_world(p)) - p), 0, 1e-15);
}

}  // namespace
}  // namespace kerf::rigid_place_test
