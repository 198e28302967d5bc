// The newest value, from one thread to another, without locks or waiting: three slots, of which the writer has one, the
// reader one, and the newest finished value lies in the third.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <type_traits>

namespace kerf {

/// One writing and one reading thread.
template <class T>
class Latest {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  void write(const T& value) {
    slots_[writing_] = value;
    writing_ = static_cast<std::uint8_t>(
        middle_.exchange(static_cast<std::uint8_t>(writing_ | kNew), std::memory_order_acq_rel) & kSlot);
  }
  /// The newest value so far; `fresh` says whether it is another one than last time. Before the first write: T().
  const T& read(bool& fresh) {
    fresh = (middle_.load(std::memory_order_relaxed) & kNew) != 0;
    if (fresh) reading_ = static_cast<std::uint8_t>(middle_.exchange(reading_, std::memory_order_acq_rel) & kSlot);
    return slots_[reading_];
  }

 private:
  static constexpr std::uint8_t kSlot = 3, kNew = 4;
  std::array<T, 3> slots_{};
  std::atomic<std::uint8_t> middle_{0};
  std::uint8_t writing_ = 1, reading_ = 2;
};

}  // namespace kerf
