#include "kerf/base/memory_limit.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "mesh/temporary_folder.h"

namespace kerf::memory_limit_test {
namespace {

constexpr std::uint64_t kGiB = std::uint64_t{1} << 30;

class FakeSystem {
 public:
  void put(const std::string& name, const std::string& text) const {
    const std::filesystem::path path = std::filesystem::path(folder_.path()) / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path) << text;
  }
  [[nodiscard]] std::uint64_t free() const { return free_memory(folder_.path()); }

 private:
  test::TemporaryFolder folder_;
};

TEST(MemoryLimit, WhatTheMachineHasAvailable) {
  const FakeSystem system;
  EXPECT_EQ(system.free(), 0U) << "nothing is known";
  system.put("proc/meminfo",
             "MemTotal:       16777216 kB\nMemFree:  1 kB\nMemAvailable:    8388608 kB\nSwapFree: 7 kB\n");
  EXPECT_EQ(system.free(), 8 * kGiB);
}

TEST(MemoryLimit, TheControlGroupMayHaveLess) {
  const FakeSystem system;
  system.put("proc/meminfo", "MemAvailable: 8388608 kB\n");
  system.put("proc/self/cgroup", "0::/jobs/mine\n");
  system.put("sys/fs/cgroup/jobs/mine/memory.max", "max\n");
  system.put("sys/fs/cgroup/jobs/mine/memory.current", "1073741824\n");
  EXPECT_EQ(system.free(), 8 * kGiB);
  system.put("sys/fs/cgroup/jobs/memory.max", "4294967296\n");
  system.put("sys/fs/cgroup/jobs/memory.current", "3221225472\n");
  EXPECT_EQ(system.free(), kGiB) << "of the group above";
  system.put("sys/fs/cgroup/jobs/mine/memory.max", "1073741824\n");
  EXPECT_EQ(system.free(), 0U) << "all of it is used";
}

TEST(MemoryLimit, AlsoOfTheFirstVersion) {
  const FakeSystem system;
  system.put("proc/meminfo", "MemAvailable: 8388608 kB\n");
  system.put("proc/self/cgroup", "5:cpu,memory:/box\n0::/\n");
  system.put("sys/fs/cgroup/memory/box/memory.limit_in_bytes", "3221225472\n");
  system.put("sys/fs/cgroup/memory/box/memory.usage_in_bytes", "1073741824\n");
  system.put("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n");
  EXPECT_EQ(system.free(), 2 * kGiB);
}

TEST(MemoryLimit, WhatIsSaidGoesForItsScope) {
  const std::uint64_t half = memory_limit();
  EXPECT_FALSE(memory_limit_is_given());
  EXPECT_GT(half, 0U);
  {
    const MemoryLimit limit(5 * kGiB);
    EXPECT_EQ(memory_limit(), 5 * kGiB);
    {
      const MemoryLimit less(kGiB);
      EXPECT_EQ(memory_limit(), kGiB);
    }
    EXPECT_EQ(memory_limit(), 5 * kGiB);
    EXPECT_TRUE(memory_limit_is_given());
  }
  EXPECT_FALSE(memory_limit_is_given());
}

}  // namespace
}  // namespace kerf::memory_limit_test
