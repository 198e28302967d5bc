#include "terminal.h"

namespace kerf::app {

std::string printable(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    const unsigned char next = i + 1 < text.size() ? static_cast<unsigned char>(text[i + 1]) : 0;
    if ((c < 32 && c != '\n' && c != '\t') || c == 127) {
      out += fmt::format("\\x{:02x}", c);
    } else if (c == 0xC2 && next >= 0x80 && next < 0xA0) {  // U+0080 to U+009F: the same, in UTF-8
      out += fmt::format("\\u{:04x}", next);
      ++i;
    } else {
      out += text[i];
    }
  }
  return out;
}

void put(std::FILE* stream, std::string_view text) {
  const std::string plain = printable(text);
  std::fwrite(plain.data(), 1, plain.size(), stream);
}

}  // namespace kerf::app
