#include "kerf/base/long_sum.h"

#include <gtest/gtest.h>

#include <cmath>

namespace kerf::long_sum_test {
namespace {

TEST(LongSum, AMillionTenthsAreAHundredThousand) {
  LongSum sum;
  double plain = 0;
  for (int i = 0; i < 1000000; ++i) {
    sum.add(0.1);
    plain += 0.1;
  }
  // 0.1 is 0.1 + 5.551e-18, a million of them 1e5 + 5.551e-12: nearer to 1e5 than to the next number after it.
  EXPECT_EQ(sum.value(), 1e5);
  EXPECT_GT(std::fabs(plain - 1e5), 1e-7);
}

TEST(LongSum, SmallOnesBesideALargeOneCount) {
  LongSum first, last;
  first.add(1e16);
  for (int i = 0; i < 10; ++i) {
    first.add(1);
    last.add(1);
  }
  last.add(1e16);
  EXPECT_EQ(first.value(), 1e16 + 10);
  EXPECT_EQ(last.value(), 1e16 + 10);
}

}  // namespace
}  // namespace kerf::long_sum_test
