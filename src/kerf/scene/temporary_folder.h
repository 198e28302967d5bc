// A folder that is gone when it is no longer needed.
#pragma once

#include <filesystem>
#include <string>
#include <utility>

#include "kerf/base/result.h"

namespace kerf {

class TemporaryFolder {
 public:
  /// A new empty folder for this user only, where the system keeps temporary files.
  static Result<TemporaryFolder> create();
  TemporaryFolder(TemporaryFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}
  TemporaryFolder& operator=(TemporaryFolder&& other) noexcept {
    std::swap(path_, other.path_);
    return *this;
  }
  ~TemporaryFolder();
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  explicit TemporaryFolder(std::filesystem::path path) : path_(std::move(path)) {}
  std::filesystem::path path_;
};

}  // namespace kerf
