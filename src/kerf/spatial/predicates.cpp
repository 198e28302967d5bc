#include "kerf/spatial/predicates.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>

namespace kerf::exact {
namespace {

// A double as mantissa x 2^exponent.
struct Whole {
  std::uint64_t mantissa;  // below 2^53
  int exponent;
  bool negative;
};

Whole whole(double x) {
  std::uint64_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  const int biased = static_cast<int>(bits >> 52 & 0x7ff);
  const std::uint64_t fraction = bits & ((1ull << 52) - 1);
  return {biased == 0 ? fraction : fraction | 1ull << 52, std::max(biased, 1) - 1075, (bits >> 63) != 0};
}

// A signed sum of products of up to three doubles, kept as digits of 32 bits that carry only at the end. Wide enough
// for any finite input: three factors span 3 (2^-1074 .. 2^1024).
class ProductSum {
 public:
  /// lowest: no factor's exponent is below it; highest: none is above; `factors` per product.
  ProductSum(int lowest, int highest, int factors)
      : base_(lowest * factors), count_(static_cast<std::size_t>((highest - lowest) * factors / 32 + 9)) {
    std::fill_n(digits_.begin(), count_, 0);
  }
  void add(bool negative, const Whole* const* factors, int n) {
    std::array<std::uint64_t, 8> p{1};
    std::size_t size = 1;
    int exponent = 0;
    for (int i = 0; i < n; ++i) {
      const Whole& f = *factors[i];
      negative ^= f.negative;
      exponent += f.exponent;
      multiply(p, size, f.mantissa);
    }
    const auto shift = static_cast<std::size_t>(exponent - base_);
    std::size_t digit = shift / 32;
    const unsigned bits = shift % 32;
    std::uint64_t carry = 0;
    for (std::size_t i = 0; i <= size; ++i) {
      const std::uint64_t moved = (i < size ? p[i] << bits : 0) | carry;
      carry = moved >> 32;
      const auto low = static_cast<std::int64_t>(moved & 0xffffffffu);
      digits_[digit++] += negative ? -low : low;
    }
  }
  [[nodiscard]] int sign() {
    std::int64_t carry = 0;
    bool any = false;
    for (std::size_t i = 0; i < count_; ++i) {
      const std::int64_t value = digits_[i] + carry;
      any = any || (value & 0xffffffff) != 0;
      carry = value >> 32;  // rounds down, so that the digits left are not negative
    }
    return carry < 0 ? -1 : any || carry > 0 ? 1 : 0;
  }

 private:
  static void multiply(std::array<std::uint64_t, 8>& p, std::size_t& size, std::uint64_t mantissa) {
    const std::uint64_t low = mantissa & 0xffffffffu, high = mantissa >> 32;
    std::array<std::uint64_t, 8> out{};
    for (std::size_t i = 0; i < size; ++i) {
      std::uint64_t t = out[i] + p[i] * low;
      out[i] = t & 0xffffffffu;
      t = (t >> 32) + out[i + 1] + p[i] * high;
      out[i + 1] = t & 0xffffffffu;
      out[i + 2] += t >> 32;
    }
    size += 2;
    p = out;
  }
  int base_;
  std::size_t count_;
  std::array<std::int64_t, 3 * 2100 / 32 + 10> digits_;
};

template <std::size_t N>
ProductSum sum_for(const std::array<Whole, N>& values, int factors) {
  int lowest = 1024, highest = -1075;
  for (const Whole& v : values) {
    if (v.mantissa == 0) continue;
    lowest = std::min(lowest, v.exponent);
    highest = std::max(highest, v.exponent);
  }
  if (lowest > highest) lowest = highest = 0;
  return {lowest, highest, factors};
}

bool zero(const Whole& v) { return v.mantissa == 0; }

}  // namespace

int orient2d(Vec2 a, Vec2 b, Vec2 c) {
  const std::array<Whole, 6> w{whole(a.x), whole(a.y), whole(b.x), whole(b.y), whole(c.x), whole(c.y)};
  ProductSum sum = sum_for(w, 2);
  const auto add = [&](bool negative, std::size_t i, std::size_t j) {
    if (zero(w[i]) || zero(w[j])) return;
    const Whole* const factors[2] = {&w[i], &w[j]};
    sum.add(negative, factors, 2);
  };
  for (std::size_t i = 0; i < 6; i += 2) {  // a x b + b x c + c x a
    const std::size_t j = (i + 2) % 6;
    add(false, i, j + 1);
    add(true, i + 1, j);
  }
  return sum.sign();
}

int orient3d(Vec3 a, Vec3 b, Vec3 c, Vec3 d) {
  // Sides of plates and boxes lie across an axis: where all is zero the filter never decides.
  for (int k = 0; k < 3; ++k)
    if (a[k] == b[k] && a[k] == c[k] && a[k] == d[k]) return 0;
  std::array<Whole, 12> w{};
  const Vec3 points[4] = {a, b, c, d};
  for (std::size_t i = 0; i < 12; ++i) w[i] = whole(points[i / 3][static_cast<int>(i % 3)]);
  ProductSum sum = sum_for(w, 3);
  // det(b, c, d) - det(a, c, d) + det(a, b, d) - det(a, b, c)
  const std::size_t triples[4][3] = {{1, 2, 3}, {0, 2, 3}, {0, 1, 3}, {0, 1, 2}};
  const std::size_t axes[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t k = 0; k < 6; ++k) {
      const Whole* factors[3];
      for (std::size_t j = 0; j < 3; ++j) factors[j] = &w[3 * triples[i][j] + axes[k][j]];
      if (zero(*factors[0]) || zero(*factors[1]) || zero(*factors[2])) continue;
      sum.add((i % 2 == 1) != (k >= 3), factors, 3);
    }
  return sum.sign();
}

}  // namespace kerf::exact
