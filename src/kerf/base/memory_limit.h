// How much memory the process may plan with: what was said, or half of what is free.
#pragma once

#include <cstdint>
#include <string>

namespace kerf {

/// Bytes that could be had: what the machine has available, and what is left to this control group where it has a limit. 0: unknown. `root`
/// stands for "/" (tests).
std::uint64_t free_memory(const std::string& root = "");

/// Bytes that something about to be made may take: what the living MemoryLimit says, else half of free_memory(). Without either, no limit.
std::uint64_t memory_limit();

/// Is there a limit that somebody gave?
bool memory_limit_is_given();

/// The limit in this scope (process-wide, restored on destruction).
class MemoryLimit {
 public:
  explicit MemoryLimit(std::uint64_t bytes);
  ~MemoryLimit();
  MemoryLimit(const MemoryLimit&) = delete;
  MemoryLimit& operator=(const MemoryLimit&) = delete;

 private:
  std::uint64_t before_;
};

}  // namespace kerf
