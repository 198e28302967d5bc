#include "kerf/base/shown_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

namespace kerf {
namespace {

/// A character of the two or three bytes of UTF-8 that those to be escaped have.
struct Character {
  std::uint32_t code = 0;
  std::size_t bytes = 1;
};

Character character_at(std::string_view text, std::size_t i) {
  const auto byte = [&](std::size_t k) { return k < text.size() ? static_cast<unsigned char>(text[k]) : 0u; };
  const auto follows = [&](std::size_t k) { return (byte(k) & 0xC0u) == 0x80u; };
  const std::uint32_t first = byte(i);
  if (first >= 0xC2 && first < 0xE0 && follows(i + 1)) return {(first & 0x1Fu) << 6 | (byte(i + 1) & 0x3Fu), 2};
  if (first >= 0xE0 && first < 0xF0 && follows(i + 1) && follows(i + 2))
    return {(first & 0x0Fu) << 12 | (byte(i + 1) & 0x3Fu) << 6 | (byte(i + 2) & 0x3Fu), 3};
  return {first, 1};
}

/// Unicode: U+0080 to U+009F are control characters; bidirectional controls (UAX #9); line and paragraph separators.
bool is_hidden(std::uint32_t code) {
  return (code >= 0x80 && code <= 0x9F) || code == 0x61C || code == 0x200E || code == 0x200F ||
         (code >= 0x2028 && code <= 0x202E) || (code >= 0x2066 && code <= 0x2069);
}

/// The nearest place at or before `i` where a character begins.
std::size_t beginning_before(std::string_view text, std::size_t i) {
  std::size_t back = 0;
  while (back < 3 && back < i && i - back < text.size() &&
         (static_cast<unsigned char>(text[i - back]) & 0xC0u) == 0x80u)
    ++back;
  return i - back;
}

}  // namespace

std::string controls_shown(std::string_view text, bool line_ends) {
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 0; i < text.size();) {
    const auto [code, bytes] = character_at(text, i);
    if (bytes == 1 && (code < 32 || code == 127) && !(line_ends && (code == '\n' || code == '\t')))
      out += fmt::format("\\x{:02x}", code);
    else if (bytes > 1 && is_hidden(code)) out += fmt::format("\\u{:04x}", code);
    else out += text.substr(i, bytes);
    i += bytes;
  }
  return out;
}

std::string shown(std::string_view text, std::size_t most) {
  if (text.size() <= most) return controls_shown(text);
  const std::size_t begin = beginning_before(text, most / 2);
  const std::size_t end = beginning_before(text, text.size() - most / 2);
  return fmt::format("{}... {} bytes ...{}", controls_shown(text.substr(0, begin)), end - begin,
                     controls_shown(text.substr(end)));
}

std::string shown_lines(std::string_view message) {
  std::string out;
  for (;;) {
    const std::size_t end = std::min(message.find('\n'), message.size());
    out += shown(message.substr(0, end), kMostOfLine);
    if (end == message.size()) return out;
    out += '\n';
    message.remove_prefix(end + 1);
  }
}

}  // namespace kerf
