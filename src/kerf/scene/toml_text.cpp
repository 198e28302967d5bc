#include "kerf/scene/toml_text.h"

#include <fmt/format.h>

#include "kerf/base/shown_text.h"
#include "kerf/base/text_encoding.h"

namespace kerf {

Status check_toml_characters(std::string_view text, std::string_view name) {
  if (const std::string fault = fault_of_text(text); !fault.empty())
    return bad_input(fmt::format("{}: {}", shown(name), fault));
  enum class In { kPlain, kComment, kString };
  In in = In::kPlain;
  char quote = 0;           // of the string
  bool multiline = false;   // the string
  bool swallowing = false;  // white space, after a backslash at the end of a line
  std::size_t line = 1;
  const auto has_three = [&](std::size_t i) { return text.substr(i, 3) == std::string(3, quote); };
  // A mark of the byte order is skipped by the parser.
  std::size_t i = text.starts_with("\xEF\xBB\xBF") ? 3 : 0;
  for (; i < text.size(); ++i) {
    const char c = text[i];
    if (static_cast<unsigned char>(c) >= 0x80) {
      if (in == In::kPlain || swallowing)
        return bad_input(fmt::format(
            "{}:{}: a character that is not ASCII; such characters belong into quotation marks or comments{}",
            shown(name), line, swallowing ? ", and not to the beginning of a line that continues a string" : ""));
      continue;
    }
    if (c == '\n') {
      ++line;
      if (in == In::kComment || (in == In::kString && !multiline)) in = In::kPlain;
      continue;
    }
    if (in == In::kPlain) {
      if (c == '#') in = In::kComment;
      if (c != '"' && c != '\'') continue;
      in = In::kString;
      quote = c;
      multiline = has_three(i);
      if (multiline) i += 2;
    } else if (in == In::kString) {
      if (swallowing && (c == ' ' || c == '\t' || c == '\r')) continue;
      swallowing = false;
      if (c == '\\' && quote == '"') {
        const std::size_t next = text.find_first_not_of(" \t\r", i + 1);
        if (multiline && next != std::string_view::npos && text[next] == '\n') swallowing = true;
        else if (i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) < 0x80 && text[i + 1] != '\n')
          ++i;  // what it escapes
      } else if (c == quote) {
        if (!multiline) {
          in = In::kPlain;
        } else if (has_three(i)) {
          in = In::kPlain;
          i += 2;
          for (int more = 0; more < 2 && i + 1 < text.size() && text[i + 1] == quote; ++more)
            ++i;  // quotes may end the string
        }
      }
    }
  }
  return {};
}

}  // namespace kerf
