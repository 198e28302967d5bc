#include "kerf/base/hypotenuse.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kerf/base/random.h"

namespace kerf::hypotenuse_test {
namespace {

TEST(Hypotenuse, IsRightWhereItIsExact) {
  EXPECT_EQ(hypotenuse(0, 0), 0);
  EXPECT_EQ(hypotenuse(-3, 4), 5);
  EXPECT_EQ(hypotenuse(20, -21), 29);
  EXPECT_EQ(hypotenuse(0, -0.1), 0.1);
  EXPECT_EQ(hypotenuse(1e20, 1), 1e20);
}

TEST(Hypotenuse, IsWithinOneUlp) {
  Random random(1);
  for (int i = 0; i < 200000; ++i) {
    const double x = random.uniform(-1, 1), y = random.uniform(-1, 1) * std::exp(random.uniform(-20, 20));
    const long double exact = std::sqrt(static_cast<long double>(x) * x + static_cast<long double>(y) * y);  // 64 bits
    const double h = hypotenuse(x, y), ulp = std::nextafter(h, HUGE_VAL) - h;
    ASSERT_LE(std::fabs(static_cast<double>(h - exact)), ulp) << x << " " << y;
  }
}

}  // namespace
}  // namespace kerf::hypotenuse_test
