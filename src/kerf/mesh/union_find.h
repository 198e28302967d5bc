// Disjoint sets over 0 .. n-1; the root of a set is its smallest member.
#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

namespace kerf {

class UnionFind {
 public:
  explicit UnionFind(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }

  std::int32_t root(std::int32_t i) {
    while (parent_[static_cast<std::size_t>(i)] != i) {
      std::int32_t& parent = parent_[static_cast<std::size_t>(i)];
      parent = parent_[static_cast<std::size_t>(parent)];  // halves the path
      i = parent;
    }
    return i;
  }
  void join(std::int32_t a, std::int32_t b) {
    a = root(a);
    b = root(b);
    if (a > b) std::swap(a, b);
    parent_[static_cast<std::size_t>(b)] = a;
  }
  [[nodiscard]] std::size_t size() const { return parent_.size(); }
  [[nodiscard]] bool is_root(std::size_t i) const { return parent_[i] == static_cast<std::int32_t>(i); }

 private:
  std::vector<std::int32_t> parent_;
};

}  // namespace kerf
