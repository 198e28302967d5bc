// What is saved lasts through a power cut: in which order the disk is asked, and what its answers come to.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "kerf/mesh/whole_file.h"
#include "mesh/temporary_folder.h"
#include "support/watched_disk.h"

namespace kerf::lasting_file_test {
namespace {

using test::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kSyncsData = "sync a.kerf.part-0";

class LastingFile : public ::testing::Test {
 protected:
  LastingFile() { disk_calls.clear(); }
  ~LastingFile() override { disk_error = {}; }
  [[nodiscard]] std::string syncs_folder() const {
    return "sync " + std::filesystem::path(folder_.path()).filename().string();
  }
  /// From now on the disk answers one of the calls so.
  static void refuse(const std::string& call, int error) {
    disk_error = [call, error](const std::string& asked) { return asked == call ? error : 0; };
  }
  [[nodiscard]] std::ptrdiff_t files() const {
    return std::distance(std::filesystem::directory_iterator(folder_.path()), {});
  }

  const TemporaryFolder folder_;
  const std::string path_ = folder_.put("a", "old");
};

TEST_F(LastingFile, DataGoesBeforeTheNameAndTheNameBeforeTheEnd) {
  const std::string bytes(3 << 20, 'x');
  std::uintmax_t size_at_sync = 0;
  disk_error = [&](const std::string& call) {
    if (call == kSyncsData) size_at_sync = std::filesystem::file_size(path_ + ".kerf.part-0");
    return 0;
  };
  ASSERT_TRUE(replace_file(path_, bytes).ok());
  EXPECT_THAT(disk_calls, ElementsAre(kSyncsData, "rename a", syncs_folder()));
  EXPECT_EQ(size_at_sync, bytes.size());
}

TEST_F(LastingFile, OfALinkTheFolderThatItLeadsToIsKept) {
  const TemporaryFolder elsewhere;
  const std::string link = elsewhere.file("link");
  std::filesystem::create_symlink(path_, link);
  ASSERT_TRUE(replace_file(link, "new").ok());
  EXPECT_THAT(disk_calls, ElementsAre(kSyncsData, "rename a", syncs_folder()));
}

TEST_F(LastingFile, WhatTheDiskDoesNotTakeLeavesTheOldFile) {
  for (const int error : {EIO, ENOSPC, EDQUOT}) {
    refuse(kSyncsData, error);
    const Status saved = replace_file(path_, "new");
    ASSERT_FALSE(saved.ok());
    EXPECT_EQ(saved.error().kind, ErrorKind::kFailed);
    EXPECT_THAT(saved.error().message, HasSubstr(path_ + ": can't be written (" + std::strerror(error)));
    EXPECT_EQ(TemporaryFolder::get(path_), "old");
    EXPECT_EQ(files(), 1);
  }
}

TEST_F(LastingFile, ANameThatMayNotLastIsToldOf) {
  refuse(syncs_folder(), EIO);
  const Status saved = replace_file(path_, "new");
  ASSERT_FALSE(saved.ok());
  EXPECT_EQ(saved.error().kind, ErrorKind::kFailed);
  EXPECT_THAT(saved.error().message, HasSubstr(folder_.path() + ": the names of new files there may not last"));
  EXPECT_EQ(TemporaryFolder::get(path_), "new");
  EXPECT_EQ(files(), 1);
}

TEST_F(LastingFile, DisksThatCannotBeAskedAreNoFailure) {
  for (const std::string& call : {std::string(kSyncsData), syncs_folder()})
    for (const int error : {EINVAL, EROFS, ENOTSUP, ENOSYS}) {
      refuse(call, error);
      EXPECT_TRUE(replace_file(path_, call + std::strerror(error)).ok());
      EXPECT_EQ(TemporaryFolder::get(path_), call + std::strerror(error));
    }
  disk_error = {};
  EXPECT_TRUE(replace_file("/dev/null", "x").ok());
}

TEST_F(LastingFile, ASignalOnlyMakesItAskAgain) {
  int signals = 3;
  disk_error = [&](const std::string& call) { return call == kSyncsData && signals-- > 0 ? EINTR : 0; };
  ASSERT_TRUE(replace_file(path_, "new").ok());
  EXPECT_THAT(disk_calls, ElementsAre(kSyncsData, kSyncsData, kSyncsData, kSyncsData, "rename a", syncs_folder()));
}

TEST_F(LastingFile, ALookWhetherItCanBeWrittenWaitsForNoDisk) {
  EXPECT_TRUE(check_can_be_written(path_).ok());
  EXPECT_THAT(disk_calls, testing::IsEmpty());
}

}  // namespace
}  // namespace kerf::lasting_file_test
