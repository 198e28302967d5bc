// "Did you mean ...?": the known word that is nearest to a misspelt one.
#pragma once

#include <span>
#include <string_view>

namespace kerf {

/// Number of insertions, deletions, replacements and swaps of neighbouring letters that turn a into b;
/// capital and small letters count as the same, - as _. O(|a| |b|).
int edit_distance(std::string_view a, std::string_view b);

/// The word with the least distance (the first of several), or an empty view when none is near enough to be a
/// likely slip: at most a third of the letters, or one letter in short words.
std::string_view closest_word(std::string_view word, std::span<const std::string_view> known);

}  // namespace kerf
