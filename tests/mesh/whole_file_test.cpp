#include "kerf/mesh/whole_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>

#include "mesh/temporary_folder.h"

namespace kerf {
namespace {

TEST(WholeFile, AnAbandonedFileLeavesTheOldOne) {
  const TemporaryFolder folder;
  const std::string path = folder.put("a", "old");
  {
    ReplacingFile file(path);
    file.write(std::string(3 << 20, 'x'));  // more than the buffer: some of it is on the disk
    EXPECT_EQ(TemporaryFolder::get(path), "old");
  }
  EXPECT_EQ(TemporaryFolder::get(path), "old");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
  ASSERT_TRUE(replace_file(path, std::string(3 << 20, 'y')).ok());
  EXPECT_EQ(TemporaryFolder::get(path), std::string(3 << 20, 'y'));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(WholeFile, AKilledRunLeavesTheOldFile) {
  const TemporaryFolder folder;
  const std::string path = folder.put("a", "old");
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    ReplacingFile file(path);
    file.write(std::string(3 << 20, 'x'));
    ::_exit(0);  // no destructor runs, as after a kill
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(TemporaryFolder::get(path), "old");
  // What the dead run left behind is in nobody's way.
  ASSERT_TRUE(replace_file(path, "new").ok());
  EXPECT_EQ(TemporaryFolder::get(path), "new");
}

TEST(WholeFile, TwoWritersOfOneFileDoNotMix) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a");
  ReplacingFile first(path);
  ReplacingFile second(path);
  first.write("first");
  second.write("second");
  ASSERT_TRUE(second.commit().ok());
  EXPECT_EQ(TemporaryFolder::get(path), "second");
  ASSERT_TRUE(first.commit().ok());
  EXPECT_EQ(TemporaryFolder::get(path), "first");
}

}  // namespace
}  // namespace kerf
