#include "kerf/mesh/whole_file.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>

#include "mesh/temporary_folder.h"

namespace kerf::whole_file_test {
namespace {

using test::TemporaryFolder;

Status looks_like_kerf(std::string_view first, const std::string& path) {
  EXPECT_LE(first.size(), kFirstBytes);
  if (first.starts_with("KERF")) return {};
  return bad_input(path + ": is something else");
}
constexpr FileKind kKind{"a test", std::size_t{1} << 30, "give a smaller one", looks_like_kerf};

void expect_refused(const Result<FileBytes>& read, const std::string& why) {
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.error().kind, ErrorKind::kBadInput);
  EXPECT_NE(read.error().message.find(why), std::string::npos) << read.error().message;
}

TEST(WholeFile, TheSizeIsLookedAtBeforeMemoryIsTaken) {
  const TemporaryFolder folder;
  const std::string path = folder.put("hole", "KERF");
  std::filesystem::resize_file(path, std::uintmax_t{1} << 43);  // a hole
  expect_refused(read_whole_file(path, kKind),
                 path + ": the file has 8.8 TB, a test has 1.07 GB at most; give a smaller one");
  std::filesystem::resize_file(path, 1 << 20);
  const auto read = read_whole_file(path, kKind);
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->size, std::size_t{1} << 20);
  EXPECT_EQ(read->view().substr(0, 5), std::string_view("KERF\0", 5));
}

TEST(WholeFile, FirstBytesAreLookedAtBeforeTheRestIsRead) {
  const TemporaryFolder folder;
  const std::string path = folder.put("a", "CARF");
  expect_refused(read_whole_file(path, kKind), "a: is something else");  // shorter than what is looked at
  folder.put("a", "KERF");
  EXPECT_TRUE(read_whole_file(path, kKind).ok());
  folder.put("a", std::string(1 << 20, 'x'));
  rusage before{}, after{};
  std::filesystem::resize_file(path, std::size_t{1} << 30);
  ::getrusage(RUSAGE_SELF, &before);
  expect_refused(read_whole_file(path, kKind), "a: is something else");
  ::getrusage(RUSAGE_SELF, &after);
  EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 100 << 10) << "kB";
}

TEST(WholeFile, OutOfMemoryNamesTheFile) {
  const auto read = within_memory("a.obj", []() -> Result<int> { throw std::bad_alloc(); });
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.error().kind, ErrorKind::kBadInput);
  EXPECT_NE(read.error().message.find("a.obj: not enough memory"), std::string::npos);
}

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
  // ... and is gone.
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(WholeFile, WhatSeveralKilledRunsLeftGoesAndWhatALivingOneHasStays) {
  const TemporaryFolder folder;
  const std::string path = folder.put("a", "old");
  const std::string other = folder.put("a.part-0", "mine");
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    ReplacingFile first(path), second(path), third(path);
    ::_exit(0);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 5);
  ReplacingFile living(path);
  living.write("living");
  ASSERT_TRUE(replace_file(path, "new").ok());
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}),
            3);  // a, the other, and the living one's
  ASSERT_TRUE(living.commit().ok());
  EXPECT_EQ(TemporaryFolder::get(path), "living");
  EXPECT_EQ(TemporaryFolder::get(other), "mine");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 2);
}

// The temporary file has a name that is no longer, and one that no other long name has.
TEST(WholeFile, ANameMayHaveAllBytesThatTheDiskTakes) {
  const TemporaryFolder folder;
  const auto count = [&] { return std::distance(std::filesystem::directory_iterator(folder.path()), {}); };
  const std::string euro = "\u20ac";
  std::string letters;
  while (letters.size() < 250) letters += euro;
  for (const std::size_t bytes : {242, 243, 244, 250, 255}) {
    const std::string path = folder.file(std::string(bytes - 5, 'n') + ".kerf");
    EXPECT_TRUE(check_can_be_written(path).ok()) << bytes;
    ASSERT_TRUE(replace_file(path, "whole").ok()) << bytes;
    EXPECT_EQ(TemporaryFolder::get(path), "whole");
  }
  ASSERT_TRUE(replace_file(folder.file(letters), "whole").ok());
  EXPECT_EQ(count(), 6);
  const std::string one = folder.file(std::string(254, 'x') + "1"), two = folder.file(std::string(254, 'x') + "2");
  {
    ReplacingFile first(one), second(two);
    EXPECT_EQ(count(), 8);
    first.write("1");
    second.write("2");
    ASSERT_TRUE(first.commit().ok() && second.commit().ok());
  }
  EXPECT_EQ(TemporaryFolder::get(one) + TemporaryFolder::get(two), "12");
  // What a killed writer left goes with the next.
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    ReplacingFile first(one), again(one);
    ::_exit(0);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(count(), 10);
  ASSERT_TRUE(replace_file(one, "new").ok());
  EXPECT_EQ(count(), 8);
  // A byte more is more than the disk takes.
  const Status longer = check_can_be_written(folder.file(std::string(256, 'x')));
  ASSERT_FALSE(longer.ok());
  EXPECT_NE(longer.error().message.find("too long for this disk"), std::string::npos) << longer.error().message;
}

TEST(WholeFile, ALinkStaysAndWhatItLeadsToIsReplaced) {
  const TemporaryFolder folder;
  const std::string path = folder.put("a", "old");
  std::filesystem::create_directory(folder.file("deep"));
  std::filesystem::create_symlink("../a", folder.file("deep/one"));
  std::filesystem::create_symlink(folder.file("deep/one"), folder.file("two"));
  ASSERT_TRUE(replace_file(folder.file("two"), "new").ok());
  EXPECT_EQ(TemporaryFolder::get(path), "new");
  EXPECT_TRUE(std::filesystem::is_symlink(folder.file("two")));
  EXPECT_TRUE(std::filesystem::is_symlink(folder.file("deep/one")));
  // One that leads to a file that is not there yet makes it.
  std::filesystem::create_symlink("later", folder.file("early"));
  ASSERT_TRUE(replace_file(folder.file("early"), "there").ok());
  EXPECT_EQ(TemporaryFolder::get(folder.file("later")), "there");
  EXPECT_TRUE(std::filesystem::is_symlink(folder.file("early")));
  // A circle is refused and stays.
  std::filesystem::create_symlink("pong", folder.file("ping"));
  std::filesystem::create_symlink("ping", folder.file("pong"));
  const Status circle = replace_file(folder.file("ping"), "never");
  ASSERT_FALSE(circle.ok());
  EXPECT_NE(circle.error().message.find("ping: its symbolic links lead round in a circle"), std::string::npos)
      << circle.error().message;
  EXPECT_TRUE(std::filesystem::is_symlink(folder.file("ping")));
}

TEST(WholeFile, WhatCannotBeWrittenIsKnownBeforehand) {
  const TemporaryFolder folder;
  const std::string path = folder.put("a", "old");
  EXPECT_TRUE(check_can_be_written(path).ok());
  EXPECT_TRUE(check_can_be_written(folder.file("new")).ok());
  EXPECT_EQ(TemporaryFolder::get(path), "old");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
  const auto refused = [](const std::string& where, const std::string& why, ErrorKind kind = ErrorKind::kBadInput) {
    const Status s = check_can_be_written(where);
    ASSERT_FALSE(s.ok()) << where;
    EXPECT_EQ(s.error().kind, kind) << where;
    EXPECT_NE(s.error().message.find(why), std::string::npos) << s.error().message;
  };
  refused("", "no file name given");
  refused(folder.path(), "is a folder");
  refused(folder.file("no/a"), "is not a folder");
  refused(folder.file(std::string(300, 'x')), "too long");
  if (std::filesystem::exists("/dev/full")) refused("/dev/full", "No space left", ErrorKind::kFailed);
  ASSERT_EQ(::mkfifo(folder.file("pipe").c_str(), 0600), 0);
  refused(folder.file("pipe"), "is a pipe, not a regular file");  // without waiting for a reader
  EXPECT_FALSE(replace_file(folder.file("pipe"), "x").ok());
  std::filesystem::create_symlink("pipe", folder.file("to-pipe"));
  refused(folder.file("to-pipe"), "is a pipe, not a regular file");
  // A pipe without a name, as of a shell.
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  const std::string shells = "/dev/fd/" + std::to_string(ends[1]);
  std::filesystem::create_symlink(shells, folder.file("to-shells"));
  for (const std::string& name : {shells, folder.file("to-shells")}) {
    EXPECT_TRUE(check_can_be_written(name).ok());
    EXPECT_TRUE(replace_file(name, "x").ok());
    char read = 0;
    EXPECT_EQ(::read(ends[0], &read, 1), 1);
    EXPECT_EQ(read, 'x');
  }
  ::close(ends[0]);
  ::close(ends[1]);
}

TEST(WholeFile, ADiskThatTakesNoByteIsKnownBeforehand) {
  const TemporaryFolder folder;
  const std::string path = folder.put("a", "old");
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit none{0, 0};
    ::setrlimit(RLIMIT_FSIZE, &none);
    const Status possible = check_can_be_written(path);
    ::_exit(!possible && possible.error().kind == ErrorKind::kFailed ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  EXPECT_EQ(TemporaryFolder::get(path), "old");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(WholeFile, OneFileIsKnownByAllItsNames) {
  const TemporaryFolder folder;
  const std::string a = folder.put("a", "x"), b = folder.put("b", "x"), root = folder.path();
  std::filesystem::create_directories(root + "/f");
  std::filesystem::create_symlink("../a", root + "/f/link");
  std::filesystem::create_hard_link(a, root + "/hard");
  std::filesystem::create_directory_symlink("f", root + "/g");
  for (const std::string& name :
       {a, root + "/./a", root + "/f/../a", root + "/f/link", root + "/g/link", root + "/hard"})
    EXPECT_TRUE(same_file(a, name) && same_file(name, a)) << name;
  EXPECT_FALSE(same_file(a, b));
  // Of what is not there yet the place counts.
  std::filesystem::create_symlink("f/new", root + "/ahead");
  for (const std::string& name :
       {root + "/f/new", root + "/f//new", root + "/g/new", root + "/none/../f/new", root + "/ahead"})
    EXPECT_TRUE(same_file(root + "/f/new", name) && same_file(name, root + "/f/new")) << name;
  EXPECT_FALSE(same_file(root + "/f/new", root + "/f/newer"));
  EXPECT_FALSE(same_file(root + "/f/new", a));
  // A folder that is not there leads to one that is as soon as it is made.
  EXPECT_TRUE(same_file(a, root + "/none/../a") && same_file(root + "/none/deeper/../../a", a));
  EXPECT_FALSE(same_file(a, root + "/none/a"));
  EXPECT_FALSE(same_file("/dev/null", "/dev/null")) << "what is written there is kept nowhere";
  std::filesystem::create_symlink("round", root + "/round");
  EXPECT_FALSE(same_file(root + "/round", root + "/round"));
}

TEST(WholeFile, AFolderIsTakenByOne) {
  const TemporaryFolder folder;
  std::filesystem::create_directory_symlink(folder.path(), folder.file("link"));
  {
    const auto first = FolderLock::take(folder.path());
    ASSERT_TRUE(first.ok());
    for (const std::string& name : {folder.path(), folder.file("link")}) {
      const auto second = FolderLock::take(name);
      ASSERT_FALSE(second.ok()) << name;
      EXPECT_EQ(second.error().kind, ErrorKind::kBadInput);
      EXPECT_NE(second.error().message.find(name + ": another program"), std::string::npos) << second.error().message;
    }
  }
  EXPECT_TRUE(FolderLock::take(folder.path()).ok()) << "it goes with its owner";
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1) << "nothing lies there";
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
}  // namespace kerf::whole_file_test
