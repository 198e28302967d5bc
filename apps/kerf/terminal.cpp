#include "terminal.h"

#include "kerf/base/shown_text.h"

namespace kerf::app {

std::string printable(std::string_view text) { return controls_shown(text, true); }

std::string printable_value(std::string_view text) { return shown(text, kMostOfLine); }

void put(std::FILE* stream, std::string_view text) {
  const std::string plain = printable(text);
  std::fwrite(plain.data(), 1, plain.size(), stream);
}

}  // namespace kerf::app
