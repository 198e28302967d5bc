// Text of others within what we say: names of files, words of files and of command lines.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace kerf {

/// Bytes of a name or a value in a message: the longest name that a disk takes (255), and some of its folders.
inline constexpr std::size_t kMostShown = 320;
/// Bytes of a sentence: two such names among words.
inline constexpr std::size_t kMostOfSentence = 1000;
/// Bytes of a line of a message: a sentence, and the place that it speaks of.
inline constexpr std::size_t kMostOfLine = 2000;

/// Control characters, characters that turn the direction of writing, and those that end a line come out as \x1b or \u202e. With
/// `line_ends` line ends and tabs stay.
std::string controls_shown(std::string_view text, bool line_ends = false);

/// Escaped, on one line. Of a text of more than `most` bytes the middle is left out, and the number of its bytes stands there.
std::string shown(std::string_view text, std::size_t most = kMostShown);

/// Each line of a message, as `shown` shows it; its line ends stay.
std::string shown_lines(std::string_view message);

}  // namespace kerf
