#include "kerf/base/parallel.h"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>

namespace kerf {

void parallel_for(std::size_t n, std::size_t grain, const std::function<void(std::size_t, std::size_t)>& body) {
  if (n == 0) return;
  grain = std::max<std::size_t>(grain, 1);
  if (n <= grain) return body(0, n);
  const std::size_t chunks = (n + grain - 1) / grain;
  tbb::parallel_for(std::size_t{0}, chunks,
                    [&](std::size_t c) { body(c * grain, std::min(n, (c + 1) * grain)); });
}

ThreadLimit::ThreadLimit(int threads)
    : control_(new tbb::global_control(tbb::global_control::max_allowed_parallelism,
                                       static_cast<std::size_t>(std::max(threads, 1)))) {}

ThreadLimit::~ThreadLimit() { delete static_cast<tbb::global_control*>(control_); }

}  // namespace kerf
