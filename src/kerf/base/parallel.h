// Parallel loops whose result does not depend on the number of threads.
#pragma once

#include <cstddef>
#include <exception>
#include <functional>

namespace kerf {

/// Calls body(begin, end) on disjoint ranges that cover 0 .. n-1. The chunk size is fixed by `grain`, never by
/// the number of threads, so per-chunk partial results can be reduced in order. Runs inline when n <= grain, and
/// where there is to be one thread: then no other is ever made.
void parallel_for(std::size_t n, std::size_t grain, const std::function<void(std::size_t, std::size_t)>& body);

/// Is this the exception that says that the system gave no thread?
bool is_lack_of_threads(const std::exception& error);

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
