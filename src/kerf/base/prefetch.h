// Asks for memory before it is needed: lists of ids lead to places all over an array, and waiting for one after the other is most of
// what a loop over them costs. No effect on any result.
#pragma once

#include <cstddef>

namespace kerf {

/// How many items ahead of its use a loop asks for the memory of one.
inline constexpr std::size_t kPrefetchAhead = 32;

/// Asks for item `id` of an indexed array; any id may be asked for, also one that the array doesn't have.
template <class Array, class Id>
inline void prefetch(const Array& array, Id id) {
  const auto* first = array.raw().data();
  if (id.index() < array.size()) __builtin_prefetch(first + id.index());
}

}  // namespace kerf
