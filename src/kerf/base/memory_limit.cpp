#include "kerf/base/memory_limit.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <optional>
#include <string>
#ifndef __wasm__
#include <fstream>
#include <sstream>
#endif

namespace kerf {
namespace {

constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();
constexpr std::uint64_t kHalf = 2;  // the other half is for the system, its cache of files and other programs

std::atomic<std::uint64_t> given{kUnlimited};

#ifdef __wasm__

}  // namespace

/// What is left of the address space: browsers give memory as it is asked for, and don't say how much they have.
std::uint64_t free_memory(const std::string& /*root*/) {
  constexpr std::uint64_t kAddresses = std::uint64_t{1} << 32, kPage = 65536;
  return kAddresses - std::min(kAddresses, kPage * __builtin_wasm_memory_size(0));
}

#else

// Names are plain text: std::filesystem::path of GCC 12 frees twice where memory runs out in operator/.

std::optional<std::uint64_t> number_in(const std::string& file) {
  std::ifstream stream(file);
  std::uint64_t value = 0;
  if (stream >> value) return value;
  return std::nullopt;  // not there, or "max"
}

std::optional<std::uint64_t> available(const std::string& root) {
  std::ifstream stream(root + "/proc/meminfo");
  for (std::string word; stream >> word;) {
    std::uint64_t kilobytes = 0;
    if (word == "MemAvailable:" && stream >> kilobytes) return kilobytes << 10;
  }
  return std::nullopt;
}

/// The folder of this process in a hierarchy of control groups: "" is the second version's.
std::string group_of(const std::string& root, const std::string& controller) {
  std::ifstream stream(root + "/proc/self/cgroup");
  for (std::string line; std::getline(stream, line);) {
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    std::istringstream controllers(line.substr(first + 1, second - first - 1));
    bool found = second == first + 1 && controller.empty();
    for (std::string name; std::getline(controllers, name, ',');) found = found || name == controller;
    if (found) return line.substr(second + 1);
  }
  return {};
}

/// What is left to the group and all above it; a container sees its own group as the topmost.
void limit_by_groups(const std::string& top, std::string group, const char* most, const char* used,
                     std::uint64_t& free) {
  while (group.ends_with('/')) group.pop_back();
  for (;;) {
    const std::string folder = top + group + "/";
    const auto limit = number_in(folder + most);
    if (limit) free = std::min(free, *limit - std::min(*limit, number_in(folder + used).value_or(0)));
    if (group.empty()) return;
    group.resize(group.find_last_of('/') == std::string::npos ? 0 : group.find_last_of('/'));  // groups are "/a/b"
  }
}

}  // namespace

std::uint64_t free_memory(const std::string& root) {
  std::uint64_t free = available(root).value_or(kUnlimited);
  limit_by_groups(root + "/sys/fs/cgroup", group_of(root, ""), "memory.max", "memory.current", free);
  limit_by_groups(root + "/sys/fs/cgroup/memory", group_of(root, "memory"), "memory.limit_in_bytes",
                  "memory.usage_in_bytes", free);
  return free == kUnlimited ? 0 : free;
}

#endif

std::uint64_t memory_limit() {
  if (memory_limit_is_given()) return given;
  const std::uint64_t free = free_memory();
  return free == 0 ? kUnlimited : free / kHalf;
}

bool memory_limit_is_given() { return given != kUnlimited; }

MemoryLimit::MemoryLimit(std::uint64_t bytes) : before_(given.exchange(bytes)) {}
MemoryLimit::~MemoryLimit() { given = before_; }

}  // namespace kerf
