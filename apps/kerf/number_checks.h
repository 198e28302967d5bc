// Checks of numbers on the command line: empty, or what is wrong with the text.
#pragma once

#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <string>

namespace kerf::app {

/// A finite number that is all of the text; NaN: there is none.
inline double number_in(const std::string& text) {
  double value = NAN;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data() + (text.starts_with('+') ? 1 : 0), end, value);
  return error == std::errc() && stop == end && std::isfinite(value) ? value : NAN;
}

inline std::string is_positive(const std::string& text) {
  return number_in(text) > 0 ? "" : "'" + text + "' is no number above 0; write one such as 0.5 or 2e3";
}
inline std::string is_not_negative(const std::string& text) {
  return number_in(text) >= 0 ? "" : "'" + text + "' is no number of 0 or more; write one such as 0.5 or 2e3";
}
inline std::string is_whole(const std::string& text) {
  std::uint64_t value = 0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error == std::errc() && stop == end) return {};
  return "'" + text + "' is no whole number of 0 or more";
}

}  // namespace kerf::app
