// A few threads that do many short things together, again and again.
#pragma once

#include <unistd.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "errors.h"
#include "kerf/base/wait_for.h"
#include "python_lock.h"

namespace kerf::python {

class Workers {
 public:
  /// As many threads as this, that of the caller included.
  explicit Workers(std::size_t threads) {
    try {
      for (std::size_t i = 1; i < threads; ++i) threads_.emplace_back([this] { serve(); });
    } catch (const std::exception&) {
      end();
      throw Failure(
          failed("there are not as many threads to be had; give fewer threads, or let the program have more processes "
                 "(ulimit -u)"));
    }
  }
  ~Workers() {
    if (getpid() != process_) {  // after a fork they are not there
      for (std::thread& thread : threads_) thread.detach();
      (void)shared_.release();  // the end of what a thread waits for would wait for that thread
      return;
    }
    end();
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
    Shared& shared = *shared_;
    {
      const std::lock_guard lock(shared.mutex);
      shared.work = &work;
      shared.count = count;
      shared.next = 0;
      shared.busy = threads_.size();
      ++shared.round;
    }
    shared.wake.notify_all();
    take();
    std::unique_lock lock(shared.mutex);
    while (!shared.done.wait_for(lock, std::chrono::milliseconds(30), [&] { return shared.busy == 0; })) {
      lock.unlock();
      idle();
      lock.lock();
    }
    shared.work = nullptr;
  }

 private:
  struct Shared {
    std::mutex mutex;
    std::condition_variable wake, done;
    const std::function<void(std::size_t)>* work = nullptr;
    std::atomic<std::size_t> next = 0;
    std::size_t count = 0, busy = 0;
    std::uint64_t round = 0;
    bool ended = false;
  };

  void end() {
    {
      const std::lock_guard lock(shared_->mutex);
      shared_->ended = true;
    }
    shared_->wake.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }
  void take() {
    Shared& shared = *shared_;
    for (std::size_t i = shared.next++; i < shared.count; i = shared.next++) (*shared.work)(i);
  }
  void serve() {
    work_for_others();
    Shared& shared = *shared_;
    std::uint64_t seen = 0;
    for (;;) {
      {
        std::unique_lock lock(shared.mutex);
        wait_for(shared.wake, lock, [&] { return shared.ended || shared.round != seen; });
        if (shared.ended) return;
        seen = shared.round;
      }
      take();
      const std::lock_guard lock(shared.mutex);
      if (--shared.busy == 0) shared.done.notify_one();
    }
  }

  pid_t process_ = getpid();
  std::unique_ptr<Shared> shared_ = std::make_unique<Shared>();
  std::vector<std::thread> threads_;
};

}  // namespace kerf::python
