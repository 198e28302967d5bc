// Numbers keys by their first appearance: shared texture coordinates of OBJ files, welded corners of STL
// files.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

namespace kerf {

/// Keys are N words. Order of numbers: first appearance, so that the same input gives the same numbering
/// everywhere.
template <int N>
class FirstSeen {
 public:
  using Key = std::array<std::uint64_t, N>;

  explicit FirstSeen(std::size_t expected) : slots_(std::bit_ceil(2 * expected + 16), -1) {}

  /// The number of a key: its old one, or the next one when it is new.
  std::int32_t number(const Key& key) {
    if (2 * keys_.size() >= slots_.size()) grow();
    std::int32_t& slot = slots_[find(key)];
    if (slot < 0) {
      slot = static_cast<std::int32_t>(keys_.size());
      keys_.push_back(key);
    }
    return slot;
  }
  [[nodiscard]] const std::vector<Key>& keys() const { return keys_; }

 private:
  [[nodiscard]] std::size_t find(const Key& key) const {
    std::uint64_t hash = 0;
    for (const std::uint64_t word : key) {
      hash = (hash ^ word) * 0x9e3779b97f4a7c15ull;
      hash ^= hash >> 32;
    }
    const std::size_t mask = slots_.size() - 1;
    std::size_t i = hash & mask;
    while (slots_[i] >= 0 && keys_[static_cast<std::size_t>(slots_[i])] != key) i = (i + 1) & mask;
    return i;
  }
  void grow() {
    slots_.assign(2 * slots_.size(), -1);
    for (std::size_t k = 0; k < keys_.size(); ++k) slots_[find(keys_[k])] = static_cast<std::int32_t>(k);
  }

  std::vector<std::int32_t> slots_;
  std::vector<Key> keys_;
};

}  // namespace kerf
