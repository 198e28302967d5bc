// A set of integer keys numbered in order of first touch. Clearing costs nothing and memory follows what was touched,
// so a search over a corner of a ten-million-face surface never pays for the whole surface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace kerf {

class SparseIndex {
 public:
  SparseIndex() : slots_(64) {}

  void clear() {
    count_ = 0;
    if (++stamp_ == 0) {  // after 2^32 clears old stamps would look fresh
      for (Slot& slot : slots_) slot.stamp = 0;
      stamp_ = 1;
    }
  }
  [[nodiscard]] std::int32_t size() const { return count_; }

  /// Number of the key, or -1.
  [[nodiscard]] std::int32_t find(std::int32_t key) const {
    for (std::size_t i = place(key);; i = (i + 1) & (slots_.size() - 1)) {
      const Slot& slot = slots_[i];
      if (slot.stamp != stamp_) return -1;
      if (slot.key == key) return slot.number;
    }
  }
  /// Number of the key, which is size() - 1 afterwards if it was not there before.
  std::int32_t insert(std::int32_t key) {
    if (2 * static_cast<std::size_t>(count_ + 1) > slots_.size()) grow();
    for (std::size_t i = place(key);; i = (i + 1) & (slots_.size() - 1)) {
      Slot& slot = slots_[i];
      if (slot.stamp != stamp_) {
        slot = {key, count_, stamp_};
        return count_++;
      }
      if (slot.key == key) return slot.number;
    }
  }

 private:
  struct Slot {
    std::int32_t key = 0, number = 0;
    std::uint32_t stamp = 0;
  };
  [[nodiscard]] std::size_t place(std::int32_t key) const {
    const std::uint64_t mixed = static_cast<std::uint64_t>(static_cast<std::uint32_t>(key)) * 0x9e3779b97f4a7c15ull;
    return static_cast<std::size_t>(mixed >> 32) & (slots_.size() - 1);
  }
  void grow() {
    std::vector<Slot> old(2 * slots_.size());
    old.swap(slots_);
    for (const Slot& slot : old) {
      if (slot.stamp != stamp_) continue;
      std::size_t i = place(slot.key);
      while (slots_[i].stamp == stamp_) i = (i + 1) & (slots_.size() - 1);
      slots_[i] = slot;
    }
  }
  std::vector<Slot> slots_;  // a power of two
  std::int32_t count_ = 0;
  std::uint32_t stamp_ = 1;
};

}  // namespace kerf
