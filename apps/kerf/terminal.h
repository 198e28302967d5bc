// What the program says to people: text without what only a terminal would understand.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <string_view>
#include <type_traits>

namespace kerf::app {

/// Names of files may hold characters that move the cursor, turn the direction of writing or change what stands there. They come out as
/// \x1b and the like (shown_text.h). Line ends and tabs stay: they are ours.
std::string printable(std::string_view text);

/// What a message quotes: on one line, too, and its middle left out where it is long.
std::string printable_value(std::string_view text);

/// Printable text to a stream.
void put(std::FILE* stream, std::string_view text);

/// Texts as printable values; all else as it is.
template <class T>
auto value_to_print(const T& value) {
  if constexpr (std::is_convertible_v<const T&, std::string_view>) return printable_value(value);
  else return value;
}

/// In the way of fmt::print. Line ends of the format stay, those of values are shown.
template <class... T>
void put_values(std::FILE* stream, fmt::string_view format, const T&... values) {
  put(stream, fmt::vformat(format, fmt::make_format_args(values...)));
}

/// To the standard output.
template <class... T>
void say(fmt::format_string<T...> format, T&&... values) {
  put_values(stdout, format, value_to_print(values)...);
}

/// To the standard error output. Errors, warnings and notes go there, however --quiet a command is.
template <class... T>
void warn(fmt::format_string<T...> format, T&&... values) {
  put_values(stderr, format, value_to_print(values)...);
}

/// "1 piece", "2 pieces".
template <class Count>
std::string counted(Count n, std::string_view thing) {
  return fmt::format("{} {}{}", n, thing, n == 1 ? "" : "s");
}

}  // namespace kerf::app
