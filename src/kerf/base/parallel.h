// Parallel loops whose result does not depend on the number of threads.
#pragma once

#include <cstddef>
#include <functional>

namespace kerf {

/// Calls body(begin, end) on disjoint ranges that cover 0 .. n-1. The chunk size is fixed by `grain`, never by
/// the number of threads, so per-chunk partial results can be reduced in order. Runs inline when n <= grain.
void parallel_for(std::size_t n, std::size_t grain, const std::function<void(std::size_t, std::size_t)>& body);

/// Number of threads parallel_for may use in this scope (process-wide limit, restored on destruction).
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  void* control_;
};

}  // namespace kerf
