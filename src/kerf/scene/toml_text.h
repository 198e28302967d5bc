// What a TOML text is checked for before the parser sees it.
#pragma once

#include <string_view>

#include "kerf/base/result.h"

namespace kerf {

/// The text must be text (fault_of_text). Characters beyond ASCII may stand in strings and comments only (TOML 1.0), not even there right after the white space that a
/// backslash at the end of a line swallows. toml++ 3.3.0 takes such a character for one of two kinds of white space and promises the
/// compiler that there is no third. `name` begins the message of the error.
[[nodiscard]] Status check_toml_characters(std::string_view text, std::string_view name);

}  // namespace kerf
