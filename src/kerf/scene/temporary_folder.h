// A folder that is gone when it is no longer needed.
#pragma once

#include <filesystem>
#include <string>
#include <utility>

#include "kerf/base/result.h"

namespace kerf {

class TemporaryFolder {
 public:
  /// A new empty folder for this user only, where the system keeps temporary files. What killed programs of this user left there goes.
  static Result<TemporaryFolder> create();
  TemporaryFolder(TemporaryFolder&& other) noexcept
      : path_(std::exchange(other.path_, {})), lock_(std::exchange(other.lock_, -1)) {}
  TemporaryFolder& operator=(TemporaryFolder&& other) noexcept {
    std::swap(path_, other.path_);
    std::swap(lock_, other.lock_);
    return *this;
  }
  ~TemporaryFolder();
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  TemporaryFolder(std::filesystem::path path, int lock) : path_(std::move(path)), lock_(lock) {}
  std::filesystem::path path_;
  int lock_ = -1;  ///< on the folder; goes with the process, however that ends. What nobody locks is left over
};

}  // namespace kerf
