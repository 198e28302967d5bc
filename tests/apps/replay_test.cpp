// kerf run --record and kerf replay, as a person calls them.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "apps/program_path.h"

namespace kerf::app::replay_test {
namespace {

int kerf(const std::string& arguments) {
  const int status = std::system((test::program_path() + " " + arguments + " >/dev/null 2>&1").c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

std::string read(const std::filesystem::path& path) {
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

TEST(Replay, ARunIsRepeatedToTheBit) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "kerf_replay_test";
  std::filesystem::create_directories(folder);
  const std::filesystem::path file = folder / "sheet.kerfrec";
  std::filesystem::remove(file);
  ASSERT_EQ(kerf("run sheet --duration 0.4 -q --out " + (folder / "out").string() + " --record " + file.string()), 0);
  EXPECT_EQ(kerf("replay " + file.string()), 0);

  const std::string good = read(file);
  const std::size_t end = good.find("\"end\":\"");
  ASSERT_NE(end, std::string::npos);
  std::string other = good;
  other[end + 8] = other[end + 8] == '0' ? '1' : '0';
  std::ofstream(folder / "other.kerfrec") << other;
  EXPECT_EQ(kerf("replay " + (folder / "other.kerfrec").string()), 1);
  std::ofstream(folder / "cut.kerfrec") << good.substr(0, good.size() / 2);
  EXPECT_EQ(kerf("replay " + (folder / "cut.kerfrec").string()), 2);
  EXPECT_EQ(kerf("replay " + (folder / "none.kerfrec").string()), 2);
  EXPECT_EQ(kerf("replay " + file.string() + " --compare " + file.string()), 0);
  EXPECT_EQ(kerf("replay " + file.string() + " --compare " + (folder / "other.kerfrec").string()), 1);
  EXPECT_EQ(kerf("replay " + file.string() + " --compare " + (folder / "cut.kerfrec").string()), 2);
}

}  // namespace
}  // namespace kerf::app::replay_test
