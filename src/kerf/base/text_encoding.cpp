#include "kerf/base/text_encoding.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

namespace kerf {
namespace {

/// Bytes of the beginning that tell UTF-16: a line or two. Half of it holds a keyword and a number, double changes nothing for ASCII.
constexpr std::size_t kLookedAt = 128;
/// Share of the pairs of bytes with one zero. ASCII in UTF-16 has all; a line of another script still has blanks and punctuation.
constexpr double kZeroPairs = 0.5;
/// Pairs of bytes that say anything: the shortest line of a mesh or a scene. A pair or two with a zero stand in any binary file.
constexpr std::size_t kLeastPairs = 4;

}  // namespace

bool is_utf16(std::string_view bytes) {
  if (bytes.starts_with("\xFF\xFE") || bytes.starts_with("\xFE\xFF")) return true;
  const std::size_t pairs = std::min(bytes.size(), kLookedAt) / 2;
  if (pairs < kLeastPairs) return false;
  std::size_t first = 0, second = 0;
  for (std::size_t i = 0; i < pairs; ++i) {
    first += bytes[2 * i] == 0 ? 1 : 0;
    second += bytes[2 * i + 1] == 0 ? 1 : 0;
  }
  // Zeros at one of the two places only: other binary data has them at both.
  return std::min(first, second) == 0 &&
         static_cast<double>(std::max(first, second)) > kZeroPairs * static_cast<double>(pairs);
}

std::string fault_of_text(std::string_view bytes) {
  if (is_utf16(bytes)) return std::string(kIsUtf16);
  const auto control = std::find_if(bytes.begin(), bytes.end(), [](char c) {
    const auto code = static_cast<unsigned char>(c);
    return (code < 32 && (code < '\t' || code > '\r')) || code == 127;
  });
  if (control == bytes.end()) return {};
  return fmt::format("this is not a text file: line {} has a byte \\x{:02x}",
                     1 + std::count(bytes.begin(), control, '\n'), static_cast<unsigned char>(*control));
}

}  // namespace kerf
