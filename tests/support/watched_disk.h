// Notes what a test program asks of its disk, and refuses what a test wants refused. Included by one file of a program.
#pragma once

#include <fcntl.h>
#include <fmt/format.h>
#include <limits.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "support/refused_new.h"

namespace {

/// "sync NAME" and "rename NAME", in their order; names without their folders.
std::vector<std::string> disk_calls;
/// Asked before each of them: an error number, or 0. May be empty.
std::function<int(const std::string& call)> disk_error;

int disk_call(const std::string& call) {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  disk_calls.push_back(call);
  return disk_error ? disk_error(call) : 0;
}

}  // namespace

// They stand before those of the C library.
extern "C" int fsync(int descriptor) {
  const kerf::test::NothingRefused notes;
  char path[PATH_MAX] = {};
  const std::string link = fmt::format("/proc/self/fd/{}", descriptor);
  if (::readlink(link.c_str(), path, sizeof path - 1) < 0) return -1;
  if (const int error = disk_call("sync " + std::filesystem::path(path).filename().string()); error != 0) {
    errno = error;
    return -1;
  }
  return static_cast<int>(::syscall(SYS_fsync, descriptor));
}

extern "C" int rename(const char* from, const char* to) noexcept {
  const kerf::test::NothingRefused notes;
  if (const int error = disk_call("rename " + std::filesystem::path(to).filename().string()); error != 0) {
    errno = error;
    return -1;
  }
  return static_cast<int>(::syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0));
}
