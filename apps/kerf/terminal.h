// What the program says to people: text without what only a terminal would understand.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <string_view>
#include <utility>

namespace kerf::app {

/// Names of files may hold control characters, which could move the cursor or change what stands there. They come out as \x1b
/// and the like; line ends and tabs stay.
std::string printable(std::string_view text);

/// Printable text to a stream.
void put(std::FILE* stream, std::string_view text);

/// To the standard output, in the way of fmt::print.
template <class... T>
void say(fmt::format_string<T...> format, T&&... values) {
  put(stdout, fmt::format(format, std::forward<T>(values)...));
}

/// To the standard error output.
template <class... T>
void warn(fmt::format_string<T...> format, T&&... values) {
  put(stderr, fmt::format(format, std::forward<T>(values)...));
}

}  // namespace kerf::app
