// A race in the body of a loop, which the thread sanitizer must see: its tests are worth nothing otherwise.
#include <chrono>
#include <cstdio>
#include <thread>

#include "kerf/base/parallel.h"

int main() {
  long sum = 0;
  kerf::parallel_for(200, 1, [&](std::size_t begin, std::size_t) {
    sum += static_cast<long>(begin);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));  // so that there is work left for another thread
  });
  std::printf("%ld\n", sum);
}
