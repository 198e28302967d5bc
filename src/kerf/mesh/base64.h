// Base64 of a stream of bytes (RFC 4648, with padding).
#pragma once

#include <cstddef>
#include <string>

namespace kerf {

class Base64Encoder {
 public:
  /// Appends the text of these bytes; up to two bytes wait for the next call.
  void add(const void* data, std::size_t size, std::string& text) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    text.reserve(text.size() + size / 3 * 4 + 8);
    for (std::size_t i = 0; i < size; ++i) {
      word_ = word_ << 8 | bytes[i];
      if (++waiting_ < 3) continue;
      put(4, text);
    }
  }
  /// Appends what still waits, padded.
  void finish(std::string& text) {
    if (waiting_ == 0) return;
    const int digits = waiting_ + 1;
    word_ <<= 8 * (3 - waiting_);
    put(digits, text);
    text.append(static_cast<std::size_t>(4 - digits), '=');
  }

 private:
  void put(int digits, std::string& text) {
    constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (int i = 0; i < digits; ++i) text += kDigits[word_ >> (18 - 6 * i) & 63];
    word_ = 0;
    waiting_ = 0;
  }

  unsigned word_ = 0;
  int waiting_ = 0;
};

}  // namespace kerf
