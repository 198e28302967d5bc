// Waiting for another thread.
#include "kerf/base/wait_for.h"

#include <gtest/gtest.h>

#include <thread>

namespace kerf::wait_for_test {
namespace {

TEST(WaitFor, GoesOnWhenItIsTrue) {
  std::mutex mutex;
  std::condition_variable condition;
  int turn = 0;
  std::thread other([&] {
    for (int i = 0; i < 100; ++i) {
      std::unique_lock lock(mutex);
      wait_for(condition, lock, [&] { return turn % 2 == 1; });
      ++turn;
      condition.notify_all();
    }
  });
  for (int i = 0; i < 100; ++i) {
    std::unique_lock lock(mutex);
    wait_for(condition, lock, [&] { return turn % 2 == 0; });
    ++turn;
    condition.notify_all();
  }
  other.join();
  EXPECT_EQ(turn, 200);
}

TEST(WaitFor, DoesNotWaitForWhatIsTrue) {
  std::mutex mutex;
  std::condition_variable condition;
  std::unique_lock lock(mutex);
  wait_for(condition, lock, [] { return true; });
  EXPECT_TRUE(lock.owns_lock());
}

}  // namespace
}  // namespace kerf::wait_for_test
