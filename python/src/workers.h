// A few threads that do many short things together, again and again.
#pragma once

#include <unistd.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "kerf/base/wait_for.h"
#include "python_lock.h"

namespace kerf::python {

class Workers {
 public:
  /// As many threads as this, that of the caller included.
  explicit Workers(std::size_t threads) {
    for (std::size_t i = 1; i < threads; ++i) threads_.emplace_back([this] { serve(); });
  }
  ~Workers() {
    if (getpid() != process_) {  // after a fork they are not there
      for (std::thread& thread : threads_) thread.detach();
      return;
    }
    {
      const std::lock_guard lock(mutex_);
      ended_ = true;
    }
    wake_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  /// Calls work(i) once for every i below count, in whichever thread is free; returns when all are done. `work` throws nothing. The caller's
  /// thread calls idle() from time to time while it waits for the others.
  void each(std::size_t count, const std::function<void(std::size_t)>& work, const std::function<void()>& idle) {
    if (threads_.empty() || count < 2 || getpid() != process_) {
      for (std::size_t i = 0; i < count; ++i) work(i);
      return;
    }
    {
      const std::lock_guard lock(mutex_);
      work_ = &work;
      count_ = count;
      next_ = 0;
      busy_ = threads_.size();
      ++round_;
    }
    wake_.notify_all();
    take();
    std::unique_lock lock(mutex_);
    while (!done_.wait_for(lock, std::chrono::milliseconds(30), [this] { return busy_ == 0; })) {
      lock.unlock();
      idle();
      lock.lock();
    }
    work_ = nullptr;
  }

 private:
  void take() {
    for (std::size_t i = next_++; i < count_; i = next_++) (*work_)(i);
  }
  void serve() {
    work_for_others();
    std::uint64_t seen = 0;
    for (;;) {
      {
        std::unique_lock lock(mutex_);
        wait_for(wake_, lock, [&] { return ended_ || round_ != seen; });
        if (ended_) return;
        seen = round_;
      }
      take();
      const std::lock_guard lock(mutex_);
      if (--busy_ == 0) done_.notify_one();
    }
  }

  pid_t process_ = getpid();
  std::vector<std::thread> threads_;
  std::mutex mutex_;
  std::condition_variable wake_, done_;
  const std::function<void(std::size_t)>* work_ = nullptr;
  std::atomic<std::size_t> next_ = 0;
  std::size_t count_ = 0, busy_ = 0;
  std::uint64_t round_ = 0;
  bool ended_ = false;
};

}  // namespace kerf::python
