// A set of integer keys numbered in order of first touch, with a slot for every key below the largest: no hashing. Clearing
// costs nothing; kept between calls, so that nobody pays for the whole mesh twice.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace kerf {

class DenseIndex {
 public:
  /// For keys below n; nothing is in it afterwards.
  void reset(std::size_t n) {
    if (slots_.size() < n) slots_.resize(n + n / 4);
    count_ = 0;
    if (++stamp_ == 0) {  // after 2^32 resets old stamps would look fresh
      for (Slot& slot : slots_) slot.stamp = 0;
      stamp_ = 1;
    }
  }
  /// Number of the key, or -1.
  [[nodiscard]] std::int32_t find(std::int32_t key) const {
    const Slot& slot = slots_[static_cast<std::size_t>(key)];
    return slot.stamp == stamp_ ? slot.number : -1;
  }
  /// Number of the key: how many there were before if it is new.
  std::int32_t insert(std::int32_t key) {
    Slot& slot = slots_[static_cast<std::size_t>(key)];
    if (slot.stamp != stamp_) slot = {stamp_, count_++};
    return slot.number;
  }

 private:
  struct Slot {
    std::uint32_t stamp = 0;
    std::int32_t number = 0;
  };
  std::vector<Slot> slots_;
  std::int32_t count_ = 0;
  std::uint32_t stamp_ = 1;
};

}  // namespace kerf
