// Temporary folders of programs that were killed: the next program removes them, and none that is in use.
#include "kerf/scene/temporary_folder.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <utility>

#include "mesh/temporary_folder.h"

namespace kerf::temporary_folder_test {
namespace {

class TemporaryFolders : public ::testing::Test {
 protected:
  void SetUp() override {
    if (const char* before = std::getenv("TMPDIR")) before_ = before;
    where_.emplace();
    place_ = std::filesystem::path(where_->file("x")).parent_path();
    ::setenv("TMPDIR", place_.c_str(), 1);
  }
  void TearDown() override {
    if (before_) ::setenv("TMPDIR", before_->c_str(), 1);
    else ::unsetenv("TMPDIR");
  }
  [[nodiscard]] std::ptrdiff_t folders() const {
    return std::distance(std::filesystem::directory_iterator(place_), std::filesystem::directory_iterator{});
  }
  /// Another program makes a folder with a file, and is killed.
  static void make_and_be_killed() {
    const pid_t child = ::fork();
    if (child == 0) {
      const auto made = TemporaryFolder::create();
      if (!made.ok()) ::_exit(1);
      std::ofstream(made->path() / "visual.obj") << "v 0 0 0" << std::endl;
      ::kill(::getpid(), SIGKILL);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status));
  }

  std::optional<std::string> before_;
  std::optional<test::TemporaryFolder> where_;
  std::filesystem::path place_;
};

TEST_F(TemporaryFolders, OfAKilledProgramGoWithTheNext) {
  make_and_be_killed();
  EXPECT_EQ(folders(), 1);
  {
    const auto next = TemporaryFolder::create();
    ASSERT_TRUE(next.ok()) << next.error().message;
    EXPECT_EQ(folders(), 1);
    EXPECT_TRUE(std::filesystem::is_empty(next->path()));
  }
  EXPECT_EQ(folders(), 0);
}

TEST_F(TemporaryFolders, InUseStay) {
  auto mine = TemporaryFolder::create(), other = TemporaryFolder::create();
  ASSERT_TRUE(mine.ok() && other.ok());
  TemporaryFolder moved = std::move(*mine);
  make_and_be_killed();
  const auto next = TemporaryFolder::create();
  EXPECT_EQ(folders(), 3);
  EXPECT_TRUE(std::filesystem::is_directory(moved.path()));
  EXPECT_TRUE(std::filesystem::is_directory(other->path()));
  moved = std::move(*other);
  EXPECT_TRUE(std::filesystem::is_directory(moved.path()));
}

TEST_F(TemporaryFolders, WhatIsSomebodyElsesStays) {
  std::filesystem::create_directory(place_ / "kerf-backup");
  std::ofstream(place_ / "kerf-temporary-file") << "mine";
  std::filesystem::create_directory_symlink("kerf-backup", place_ / "kerf-temporary-link");
  ASSERT_TRUE(TemporaryFolder::create().ok());
  EXPECT_EQ(folders(), 3);
}

}  // namespace
}  // namespace kerf::temporary_folder_test
