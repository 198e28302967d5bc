// Files that are to be text: what they are instead.
#pragma once

#include <string>
#include <string_view>

namespace kerf {

/// By its byte order mark, or by zero bytes at every other place of its beginning.
bool is_utf16(std::string_view bytes);

/// What is wrong with a file that should be UTF-8, and the way out; empty: nothing is. It is UTF-16, or has a control
/// character that no text has.
std::string fault_of_text(std::string_view bytes);

/// What fault_of_text says of UTF-16.
inline constexpr std::string_view kIsUtf16 = "the file is UTF-16; save it as UTF-8";

}  // namespace kerf
