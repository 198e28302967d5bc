// FNV-1a over bytes: state hashes of recordings and tests. Only for values without padding.
#pragma once

#include <cstdint>
#include <cstring>
#include <type_traits>
#include <vector>

namespace kerf {

class Hash {
 public:
  void add_bytes(const void* data, std::size_t n) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    std::size_t i = 0;
    for (; i + 8 <= n; i += 8) {  // eight bytes a round: hashing must not dominate a replay
      std::uint64_t word;
      std::memcpy(&word, bytes + i, 8);
      mix(word);
    }
    std::uint64_t rest = 0;
    if (i < n) std::memcpy(&rest, bytes + i, n - i);
    mix(rest ^ (std::uint64_t{n} << 56));
  }
  template <class T>
  void add(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    add_bytes(&value, sizeof value);
  }
  template <class T>
  void add(const std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    add_bytes(values.data(), values.size() * sizeof(T));
  }
  [[nodiscard]] std::uint64_t value() const { return state_; }

 private:
  void mix(std::uint64_t word) {
    state_ = (state_ ^ word) * 0x100000001b3ull;
    state_ ^= state_ >> 29;
  }
  std::uint64_t state_ = 0xcbf29ce484222325ull;
};

}  // namespace kerf
