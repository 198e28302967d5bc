// Recordings that failed once, and how failures become such recordings.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "kerf/mesh/whole_file.h"
#include "session/recorded_session.h"
#include "support/source_dir.h"

namespace kerf::test::regressions_test {
namespace {

using Kind = SessionChange::Kind;

TEST(Regressions, WhatFailedOnceHolds) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::path(test::source_dir()) / "tests" / "regressions"))
    if (entry.path().extension() == ".kerfrec") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const auto& file : files) {
    const auto text = read_whole_file(file.string(), kOtherFile);
    ASSERT_TRUE(text.ok());
    const auto recording = parse_recording(text->view(), file.string());
    ASSERT_TRUE(recording.ok()) << recording.error().message;
    const auto problem = problem_in(*recording);
    EXPECT_FALSE(problem) << file << ", change " << problem->change << ", step " << problem->step << ": "
                          << problem->what;
  }
}

Result<RecordedSession> sheet() {
  return RecordedSession::create(
      "[body]\nmodel = \"sheet\"\noptions = {visual_triangles = 1664}\n[simulation]\ntime_step = 0.001\n", "sheet");
}

void cut(RecordedSession& session, Vec3 from, Vec3 to) {
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, true).ok());
  const Vec3 up{0, 0, 1};
  for (int i = 0; i <= 4; ++i)
    ASSERT_TRUE(session.move_blade(lerp(from, to, i / 4.0) + up, lerp(from, to, i / 4.0) - up).ok());
  ASSERT_TRUE(session.end_stroke().ok());
}

TEST(Regressions, ARecordedSessionPlaysToTheSameBits) {
  auto session = sheet();
  ASSERT_TRUE(session.ok()) << session.error().message;
  SceneCommand command;
  SceneGrasp grasp;
  grasp.id = "g";
  grasp.point = {0.5, 0.5, 0};
  command.what = grasp;
  ASSERT_TRUE(session->apply(command).ok());
  SceneMove move;
  move.id = "g";
  move.by = {0, 0, 0.01};
  move.over = 0.003;
  command.what = move;
  ASSERT_TRUE(session->apply(command).ok());
  cut(*session, {-0.6, 0.1, 0}, {0.2, 0.1, 0});
  ASSERT_TRUE(session->step(3).ok());
  const auto kept = session->snapshot();
  cut(*session, {0, -0.6, 0}, {0, 0.6, 0});
  ASSERT_TRUE(session->step(3).ok());
  session->restore(kept);
  cut(*session, {-0.3, -0.6, 0}, {-0.3, 0.6, 0});
  ASSERT_TRUE(session->undo().ok());
  ASSERT_TRUE(session->redo().ok());
  ASSERT_TRUE(session->step(4).ok());
  Recording recording = session->recording();
  EXPECT_EQ(recording.last_step, 7);
  recording.end_hash = session->hash();
  const auto read = parse_recording(recording_text(recording), "again");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_FALSE(problem_in(*read));
  const auto played = replay(*read);
  ASSERT_TRUE(played.ok());
  EXPECT_EQ(played->first_difference, -1);
}

// A planted failure: a cut that crosses x = 0, and two steps and an undo later than that.
TEST(Regressions, FailuresShrinkToWhatTheyNeed) {
  auto session = sheet();
  ASSERT_TRUE(session.ok());
  for (int i = 0; i < 6; ++i) {
    cut(*session, {-0.6, -0.4 + 0.15 * i, 0}, {i == 3 ? 0.3 : -0.2, -0.4 + 0.15 * i, 0});
    ASSERT_TRUE(session->step(5).ok());
  }
  ASSERT_TRUE(session->undo().ok());
  ASSERT_TRUE(session->step(9).ok());
  const auto planted = [](const Recording& r) -> std::optional<Problem> {
    std::int64_t crossed = -1;
    double last = 1;  // x of the blade before, in the same stroke
    for (std::size_t i = 0; i < r.changes.size(); ++i) {
      const SessionChange& c = r.changes[i];
      if (c.kind == Kind::kBlade && last < 0 && c.values[0] > 0) crossed = c.step;
      last = c.kind == Kind::kBlade ? c.values[0] : 1;
      if (c.kind == Kind::kUndo && crossed >= 0 && c.step >= crossed + 2)
        return Problem{Problem::Kind::kUndoFails, "planted", i + 1, c.step};
    }
    return {};
  };
  const Recording all = session->recording();
  ASSERT_TRUE(planted(all));
  const Recording small = shrunk(all, Problem::Kind::kUndoFails, planted, std::chrono::seconds(60));
  ASSERT_TRUE(planted(small));
  std::vector<Kind> kinds;
  for (const SessionChange& c : small.changes) kinds.push_back(c.kind);
  EXPECT_THAT(kinds, testing::ElementsAre(Kind::kBlade, Kind::kBlade, Kind::kUndo));
  EXPECT_EQ(small.last_step, 2);
  // One of another kind is left alone.
  EXPECT_EQ(shrunk(all, Problem::Kind::kRedoFails, planted, std::chrono::seconds(5)).changes.size(),
            all.changes.size());
}

}  // namespace
}  // namespace kerf::test::regressions_test
