// A sum of many numbers whose rounding does not grow with how many there are.
#pragma once

#include <cmath>

namespace kerf {

/// Neumaier's sum: what each addition rounds away is added up by itself. The error is that of one rounding of the sum, and n roundings
/// of roundings: of terms of one sign less than two units in the last place for up to 1e15 of them.
class LongSum {
 public:
  void add(double x) {
    const double sum = sum_ + x;
    lost_ += std::fabs(sum_) >= std::fabs(x) ? (sum_ - sum) + x : (x - sum) + sum_;
    sum_ = sum;
  }
  double value() const { return sum_ + lost_; }

 private:
  double sum_ = 0, lost_ = 0;
};

}  // namespace kerf
