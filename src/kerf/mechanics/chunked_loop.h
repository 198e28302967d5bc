// A loop over fixed chunks, in order on one thread or by parallel_for: the chunks are the same either way.
#pragma once

#include <algorithm>
#include <cstddef>

#include "kerf/base/parallel.h"

namespace kerf {

/// Calls body(begin, end, chunk). Allocates nothing.
template <class Body>
void for_each_chunk(bool parallel, std::size_t n, std::size_t grain, const Body& body) {
  if (!parallel) {
    for (std::size_t begin = 0; begin < n; begin += grain) body(begin, std::min(n, begin + grain), begin / grain);
    return;
  }
  parallel_for(n, grain, [&body, grain](std::size_t begin, std::size_t end) { body(begin, end, begin / grain); });
}

}  // namespace kerf
