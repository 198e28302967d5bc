#include "kerf/base/parallel.h"

#ifndef KERF_ONE_THREAD
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#endif

#include <algorithm>
#include <string_view>
#include <system_error>

#ifdef KERF_TELL_THREAD_SANITIZER
// oneAPI TBB as packaged is not built with the thread sanitizer, nor is this file (CMakeLists.txt): it is told what comes before what, and sees
// the bodies of loops.
extern "C" void __tsan_acquire(void* token);
extern "C" void __tsan_release(void* token);
#endif

namespace kerf {

#ifndef KERF_ONE_THREAD
namespace {

void comes_after([[maybe_unused]] char& token) {
#ifdef KERF_TELL_THREAD_SANITIZER
  __tsan_acquire(&token);
#endif
}
void comes_before([[maybe_unused]] char& token) {
#ifdef KERF_TELL_THREAD_SANITIZER
  __tsan_release(&token);
#endif
}

}  // namespace
#endif

void parallel_for(std::size_t n, std::size_t grain, const std::function<void(std::size_t, std::size_t)>& body) {
  if (n == 0) return;
  grain = std::max<std::size_t>(grain, 1);
  if (n <= grain) return body(0, n);
  const std::size_t chunks = (n + grain - 1) / grain;
#ifdef KERF_ONE_THREAD
  for (std::size_t c = 0; c < chunks; ++c) body(c * grain, std::min(n, (c + 1) * grain));
#else
  if (tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism) == 1) {
    for (std::size_t c = 0; c < chunks; ++c) body(c * grain, std::min(n, (c + 1) * grain));
    return;
  }
  char begun = 0, done = 0;
  comes_before(begun);
  tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t c) {
    comes_after(begun);
    body(c * grain, std::min(n, (c + 1) * grain));
    comes_before(done);
  });
  comes_after(done);
#endif
}

bool is_lack_of_threads(const std::exception& error) {
  if (const auto* system = dynamic_cast<const std::system_error*>(&error))
    return system->code() == std::errc::resource_unavailable_try_again;
  return std::string_view(error.what()).find("pthread_create") !=
         std::string_view::npos;  // TBB throws a plain runtime_error
}

#ifdef KERF_ONE_THREAD
ThreadLimit::ThreadLimit(int /*threads*/) : control_(nullptr) {}
ThreadLimit::~ThreadLimit() = default;
#else
ThreadLimit::ThreadLimit(int threads)
    : control_(new tbb::global_control(tbb::global_control::max_allowed_parallelism,
                                       static_cast<std::size_t>(std::max(threads, 1)))) {}

ThreadLimit::~ThreadLimit() { delete static_cast<tbb::global_control*>(control_); }
#endif

}  // namespace kerf
