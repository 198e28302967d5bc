// Numbers and words of a text held in memory, line by line: what the readers of OBJ, PLY, STL and OFF share.
#pragma once

#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>
#include <system_error>

namespace kerf {

/// A position in a text. Lines end at \n, \r\n or \r and count from 1. All functions stop at the end of the
/// text.
class TextScanner {
 public:
  TextScanner(std::string_view text, std::size_t first_line = 1)
      : at_(text.data()), end_(text.data() + text.size()), line_(first_line) {}

  [[nodiscard]] std::size_t line() const { return line_; }
  [[nodiscard]] bool at_end() const { return at_ == end_; }
  [[nodiscard]] const char* position() const { return at_; }
  [[nodiscard]] std::size_t bytes_left() const { return static_cast<std::size_t>(end_ - at_); }

  void skip_blanks() {
    while (at_ != end_ && is_blank(*at_)) ++at_;
  }
  /// Skips blanks; true at a line break or the end of the text.
  bool at_line_end() {
    skip_blanks();
    return at_ == end_ || is_break(*at_);
  }
  /// Skips the rest of this line and its line break.
  void next_line() {
    while (at_ != end_ && !is_break(*at_)) ++at_;
    if (at_ == end_) return;
    ++line_;
    if (*at_ == '\r' && at_ + 1 != end_ && at_[1] == '\n') ++at_;
    ++at_;
  }
  /// Skips blank lines, and lines that begin with the comment character (0: there are none).
  void skip_empty_lines(char comment) {
    while (at_ != end_) {
      skip_blanks();
      if (at_ == end_ || !(is_break(*at_) || (comment != 0 && *at_ == comment))) return;
      next_line();
    }
  }
  /// The next word of this line, empty at its end.
  std::string_view word() {
    skip_blanks();
    const char* begin = at_;
    while (at_ != end_ && !is_blank(*at_) && !is_break(*at_)) ++at_;
    return {begin, static_cast<std::size_t>(at_ - begin)};
  }
  /// The rest of this line without blanks at its ends; the line break stays.
  std::string_view rest_of_line() {
    skip_blanks();
    const char* begin = at_;
    while (at_ != end_ && !is_break(*at_)) ++at_;
    const char* last = at_;
    while (last != begin && is_blank(last[-1])) --last;
    return {begin, static_cast<std::size_t>(last - begin)};
  }
  /// The word ahead for an error message, shortened, without moving.
  [[nodiscard]] std::string word_ahead() const {
    TextScanner copy = *this;
    return shown(copy.word());
  }
  /// A word made fit for an error message.
  static std::string shown(std::string_view word) {
    std::string out;
    for (const char c : word.substr(0, 24)) out += (c >= 32 && c < 127) ? c : '?';
    return word.empty() ? "the end of the line" : "'" + out + (word.size() > 24 ? "...'" : "'");
  }
  /// True when the next character is c, which is then skipped.
  bool skip(char c) {
    if (at_ == end_ || *at_ != c) return false;
    ++at_;
    return true;
  }
  void step() {
    if (at_ != end_) ++at_;
  }
  /// Goes back to where a word of this text begins, plus so many characters of it; both on this line.
  void back_to(std::string_view word, std::size_t characters) { at_ = word.data() + characters; }
  /// Reads a number that ends where a word ends. Not moved and false when there is none; nan and inf are
  /// numbers.
  bool number(double& value) {
    skip_blanks();
    const char* begin = at_;
    if (begin != end_ && *begin == '+') ++begin;
    const auto [stop, error] = std::from_chars(begin, end_, value);
    if (error == std::errc::invalid_argument || !ends_word(stop)) return false;
    if (error == std::errc::result_out_of_range) {
      // Too small becomes the nearest number, too large infinity, which the caller refuses.
      value = std::strtod(std::string(begin, stop).c_str(), nullptr);
    }
    at_ = stop;
    return true;
  }
  /// Reads an integer and stops behind its last digit. Not moved and false when there is none or it is too
  /// long.
  bool integer(std::int64_t& value) {
    const char* begin = at_;
    if (begin != end_ && *begin == '+') ++begin;
    const auto [stop, error] = std::from_chars(begin, end_, value);
    if (error != std::errc()) return false;
    at_ = stop;
    return true;
  }
  /// Skips blanks and reads an integer that ends where a word ends.
  bool integer_word(std::int64_t& value) {
    skip_blanks();
    const char* begin = at_;
    if (integer(value) && ends_word(at_)) return true;
    at_ = begin;
    return false;
  }

  static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }
  static bool is_break(char c) { return c == '\n' || c == '\r'; }

 private:
  [[nodiscard]] bool ends_word(const char* p) const { return p == end_ || is_blank(*p) || is_break(*p); }

  const char* at_;
  const char* end_;
  std::size_t line_;
};

}  // namespace kerf
