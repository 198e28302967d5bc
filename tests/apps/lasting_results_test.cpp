// Results of a command last: a report that says "complete" stands on the disk after all that it names.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "command_run.h"
#include "exit_status.h"
#include "folder.h"
#include "mesh/temporary_folder.h"
#include "support/watched_disk.h"

namespace kerf::app::lasting_results_test {
namespace {

using test::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class LastingResults : public ::testing::Test {
 protected:
  LastingResults() { disk_calls.clear(); }
  ~LastingResults() override { disk_error = {}; }
  [[nodiscard]] int run() const {
    RunOptions options;
    options.scene = scene_;
    options.out = folder_.file("out");
    options.record = folder_.file("r.kerfrec");
    options.quiet = true;
    return run_scene(options);
  }
  [[nodiscard]] std::string report() const { return TemporaryFolder::get(folder_.file("out/report.json")); }

  const TemporaryFolder folder_;
  const std::string scene_ = folder_.put(
      "s.toml",
      "[body]\nmodel = \"strip\"\n[simulation]\nduration = 0.002\n[output]\npicture = false\npositions = true\n");
};

TEST_F(LastingResults, AMadeFolderLastsWithThoseAboveIt) {
  ASSERT_TRUE(make_folder(folder_.file("a/b/c")).ok());
  const std::string above = std::filesystem::path(folder_.path()).filename().string();
  EXPECT_THAT(disk_calls, ElementsAre("sync b", "sync a", "sync " + above));
  ASSERT_TRUE(make_folder(folder_.file("a/b/c")).ok());
  EXPECT_EQ(disk_calls.size(), 3u) << "nothing was made";
}

TEST_F(LastingResults, TheReportOfACompleteRunIsTheLastThatIsSaved) {
  ASSERT_EQ(run(), kSuccess);
  std::vector<std::string> saved;
  for (std::size_t i = 0; i < disk_calls.size(); ++i) {
    if (!disk_calls[i].starts_with("rename ")) continue;
    const std::string name = disk_calls[i].substr(7);
    ASSERT_TRUE(i > 0 && i + 1 < disk_calls.size()) << name;
    EXPECT_EQ(disk_calls[i - 1], "sync " + name + ".kerf.part-0");
    EXPECT_THAT(disk_calls[i + 1], testing::StartsWith("sync "));
    saved.push_back(name);
  }
  EXPECT_EQ(saved.front(), "report.json");
  EXPECT_EQ(saved.back(), "report.json");
  std::sort(saved.begin(), saved.end());
  saved.erase(std::unique(saved.begin(), saved.end()), saved.end());
  std::vector<std::string> there{"r.kerfrec"};
  for (const auto& entry : std::filesystem::directory_iterator(folder_.file("out")))
    there.push_back(entry.path().filename().string());
  EXPECT_THAT(saved, testing::UnorderedElementsAreArray(there)) << "nothing is written past the disk's answer";
}

TEST_F(LastingResults, ADiskThatDoesNotTakeAResultFailsTheRun) {
  disk_error = [](const std::string& call) { return call == "sync visual.obj.kerf.part-0" ? EIO : 0; };
  EXPECT_EQ(run(), kRunFailed);
  EXPECT_THAT(report(), HasSubstr("\"status\": \"failed\""));
  EXPECT_THAT(report(), HasSubstr("visual.obj: can't be written (Input/output error)"));
  EXPECT_TRUE(std::filesystem::exists(folder_.file("r.kerfrec"))) << "the recording is saved all the same";
}

}  // namespace
}  // namespace kerf::app::lasting_results_test
