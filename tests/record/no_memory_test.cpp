// Recordings are written, read and repeated while memory runs out: requests are refused once, one after the other.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "kerf/base/parallel.h"
#include "kerf/mesh/whole_file.h"
#include "kerf/record/recording.h"
#include "kerf/session/session.h"

#include "mesh/temporary_folder.h"
#include "support/counted_new.h"

namespace kerf::no_memory_test {
namespace {

/// A strip that a blade goes through, and then everything is taken back; with its hashes.
Recording example() {
  Recording r;
  r.source.name = "strip";
  r.source.text = "[body]\nmodel = \"strip\"\n[simulation]\ntime_step = 0.001\n";
  r.source.files.push_back({"a.bin", std::string("\0\xff\x80z", 4)});
  r.source.meshes.push_back({"m.obj", 3, 0xc864724a99db7908ull, std::string("\xff\0v", 3)});
  r.overrides.dust = 0;
  r.instructions = instruction_set();
  using Kind = SessionChange::Kind;
  r.changes = {{1, Kind::kBeginStroke, {}, {}, {1, 1}},
               {1, Kind::kBlade, {}, {}, {0.01, -0.1, 0.1, 0.01, -0.1, -0.1}},
               {2, Kind::kBlade, {}, {}, {0.01, 0.1, 0.1, 0.01, 0.1, -0.1}},
               {2, Kind::kEndStroke, {}, {}, {}},
               {3, Kind::kUndo, {}, {}, {}}};
  r.last_step = 4;
  return r;
}

class RecordingNoMemory : public ::testing::Test {
 protected:
  const ThreadLimit one_{1};
  test::TemporaryFolder folder_;
};

TEST_F(RecordingNoMemory, AFileIsReadOrNamed) {
  const std::string text = recording_text(example()), path = folder_.put("a.kerfrec", text);
  const long refusals = test::with_requests_refused(
      0, 1,
      [&] {
        const auto read = read_recording(path);
        const test::NothingRefused here;
        if (read.ok()) {
          EXPECT_EQ(recording_text(*read), text);
        } else {
          EXPECT_TRUE(read.error().message.find("a.kerfrec: not enough memory") != std::string::npos)
              << read.error().message;
        }
      },
      [](bool, bool) {});
  EXPECT_GT(refusals, 40);
}

TEST_F(RecordingNoMemory, ASaveLeavesTheOldFileOrTheNew) {
  const Recording recording = example();
  const std::string text = recording_text(recording), path = folder_.file("a.kerfrec"), old = "the old file\n";
  const long refusals = test::with_requests_refused(
      0, 1,
      [&] {
        {
          const test::NothingRefused before;
          ASSERT_TRUE(replace_file(path, old).ok());
        }
        (void)replace_file(path, recording_text(recording));
      },
      [&](bool refused, bool) {
        const auto now = read_whole_file(path, kOtherFile);
        ASSERT_TRUE(now.ok());
        EXPECT_TRUE(now->view() == old || now->view() == text);
        if (!refused) {
          EXPECT_EQ(now->view(), text);
        }
      });
  EXPECT_GT(refusals, 40);
}

/// The same life in a session, for the hashes.
void live(Recording& r) {
  const auto scene = scene_of(r.source, r.overrides);
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  auto session = Session::create(*scene);
  ASSERT_TRUE(session.ok());
  r.hashes = {{0, session->hash()}};
  for (std::int64_t step = 0; step <= r.last_step; ++step) {
    for (const SessionChange& c : r.changes)
      if (c.step == step) {
        ASSERT_TRUE(apply(*session, c).ok());
      }
    if (step < r.last_step) {
      ASSERT_TRUE(session->step().ok());
    }
  }
  r.end_hash = session->hash();
}

/// Refuses every `step`-th request of a replay: it comes to the same bits, or is thrown out of.
void replay_with_refusals(long step) {
  Recording recording = example();
  recording.source.meshes.clear();
  recording.source.files.clear();
  live(recording);
  const long refusals = test::with_requests_refused(
      0, step,
      [&] {
        const auto again = replay(recording);
        const test::NothingRefused here;
        if (!again.ok()) {
          EXPECT_TRUE(again.error().message.find("memory") != std::string::npos) << again.error().message;
          return;
        }
        EXPECT_EQ(again->first_difference, -1);
        EXPECT_EQ(again->first_refused, "");
      },
      [](bool, bool) {});
  EXPECT_GT(refusals, 10);
}

TEST_F(RecordingNoMemory, PartsOfAReplayCanFail) { replay_with_refusals(97); }
TEST_F(RecordingNoMemory, EveryPartOfAReplayCanFail) { replay_with_refusals(29); }

}  // namespace
}  // namespace kerf::no_memory_test
