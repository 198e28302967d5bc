// The report of a command that leaves results in a folder, however its work ends.
#include "result_folder.h"

#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <new>
#include <stdexcept>

#include "exit_status.h"
#include "session/make_session.h"
#include "support/counted_new.h"

namespace kerf::app::result_folder_test {
namespace {

class ResultFolder : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) / ("kerf_results_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  [[nodiscard]] bool report_has(const std::string& text) const {
    std::ifstream stream(folder_ / "report.json");
    const std::string all{std::istreambuf_iterator<char>(stream), {}};
    return all.find(text) != std::string::npos;
  }
  int work(const std::function<Status()>& what) {
    return work_reported({session_, log_, folder_, {"report.json"}, {}}, what);
  }

  static Session strip() {
    Scene scene;
    scene.body.model = "strip";
    return test::make(scene);
  }

  Session session_ = strip();
  RunLog log_;
  std::filesystem::path folder_;
};

TEST_F(ResultFolder, TheReportSaysHowTheWorkEnds) {
  bool told = false;
  const auto done = [&] {
    told = report_has("\"status\": \"running\"");
    return Status{};
  };
  EXPECT_EQ(work(done), kSuccess);
  EXPECT_TRUE(told);
  EXPECT_TRUE(report_has("\"status\": \"complete\""));
  EXPECT_EQ(work([] { return Status(bad_input("not this")); }), kBadInput);
  EXPECT_TRUE(report_has("\"status\": \"failed\"") && report_has("\"reason\": \"not this\""));
  EXPECT_EQ(work([] { return Status(failed("not so")); }), kRunFailed);
  EXPECT_TRUE(report_has("\"reason\": \"not so\""));
}

TEST_F(ResultFolder, AnExceptionIsToldAndGoesOn) {
  EXPECT_THROW(work([]() -> Status { throw std::bad_alloc(); }), std::bad_alloc);
  EXPECT_TRUE(report_has("\"status\": \"failed\"") && report_has("\"reason\": \"not enough memory"));
  EXPECT_THROW(work([]() -> Status { throw std::runtime_error("the disk is on fire"); }), std::runtime_error);
  EXPECT_TRUE(report_has("\"reason\": \"the disk is on fire\""));
}

// Not a byte is left, but what was kept for this.
TEST_F(ResultFolder, ARunWithoutMemorySaysThatItFailed) {
  log_.steps.resize(300'000);  // a whole report sorts their times
  const auto used_up = []() -> Status {
    memory_left = 0;
    throw std::bad_alloc();
  };
  EXPECT_THROW(work(used_up), std::bad_alloc);
  memory_left = kNoLimit;
  EXPECT_TRUE(report_has("\"status\": \"failed\"") && report_has("\"reason\": \"not enough memory; use smaller"));
  EXPECT_TRUE(report_has("\"simulated_seconds\"") && report_has("\"notes\""));
  // The work was done; its report did not fit.
  const auto done = [] {
    memory_left = 0;
    return Status{};
  };
  EXPECT_THROW(work(done), std::bad_alloc);
  memory_left = kNoLimit;
  EXPECT_TRUE(report_has("\"status\": \"failed\"") && report_has("\"reason\": \"not enough memory; use smaller"));
}

TEST_F(ResultFolder, AReportThatCannotBeWrittenIsAnError) {
  std::filesystem::create_directories(folder_ / "report.json");
  bool begun = false;
  const auto begin = [&] {
    begun = true;
    return Status{};
  };
  EXPECT_EQ(work(begin), kRunFailed);
  EXPECT_FALSE(begun);
}

}  // namespace
}  // namespace kerf::app::result_folder_test
